#include "renderer/techniques/half_angle_light.h"

#include <glm/geometric.hpp>

#include "absl/strings/str_cat.h"
#include "renderer/frame.h"
#include "renderer/light_spread.h"
#include "renderer/shadow_technique.h"
#include "renderer/techniques/half_angle_tiles.h"

namespace halflight {

namespace {

LightChannels ChannelsOf(const Traversal& traversal) {
  return {.colored = traversal.colored_light_buffer, .unscattered = traversal.keep_unscattered};
}

// The light buffers of a traversal. `before` holds what the slices so far left; `after` also the
// current slice, and `scratch` is the blur's; neither exists unless it is needed.
struct LightBuffers {
  LightBuffer before;
  LightBuffer after;
  LightBuffer scratch;

  explicit LightBuffers(const Traversal& traversal) {
    const int size = traversal.light_buffer_size;
    const LightChannels channels = ChannelsOf(traversal);
    before = MakeLightBuffer("light buffer", size, channels);
    if (traversal.interpolate) after = MakeLightBuffer("light buffer, next", size, channels);
    if (traversal.blur) scratch = MakeLightBuffer("light buffer, blur", size, channels);
  }
};

// Slice by slice, through the blend units: deposits it, draws it, blurs.
absl::Status DrawSlicesByBlending(const TraversalContext& context, const SlicedLight& sliced,
                                  ShadowResult& shadow) {
  const Traversal& traversal = context.traversal;
  const DeviceOrder& order = sliced.order;
  Gpu& gpu = context.gpu;
  context.clock.BeginGpu("light and composite");
  LightBuffers buffers(traversal);
  const auto blur = [&](double from, double to) {
    return sliced.blur(from, to, buffers.before, buffers.scratch);
  };
  RasterPieces& pieces = context.pieces;
  const QuadCosts eye_costs =
      pieces.CostsOf(sliced.composite.eye_splats, order.count(), context.eye.projection.size);
  const QuadCosts light_costs =
      pieces.CostsOf(sliced.splats, order.count(), sliced.light.projection.size);
  const size_t slices = order.slice_begin.size() - 1;
  shadow.light_layers = DescribeLightImage(traversal, static_cast<int>(slices));
  for (size_t s = 0; s < slices; ++s) {
    if (context.stop.stop_requested()) return absl::CancelledError("frame cancelled");
    const uint32_t begin = order.slice_begin[s];
    const uint32_t end = order.slice_begin[s + 1];
    if (traversal.blur && s > 0) {
      if (absl::Status status = blur(order.slice_position[s - 1], order.slice_position[s]);
          !status.ok()) {
        return status;
      }
    }
    LightBuffer& deposit_into = traversal.interpolate ? buffers.after : buffers.before;
    const auto deposit = [&] {
      return pieces.Draw(light_costs, begin, end, context.stop, [&](uint32_t from, uint32_t to) {
        return DepositSlice(gpu, sliced.splats, sliced.light, context.scene.material.profile,
                            sliced.channels, from, to, deposit_into);
      });
    };
    const auto draw = [&] {
      const SliceLight slice_light{buffers.before, deposit_into};
      return pieces.Draw(eye_costs, begin, end, context.stop, [&](uint32_t from, uint32_t to) {
        return CompositeSlice(gpu, sliced.composite, from, to, &slice_light, context.targets);
      });
    };
    // Plain slicing sees the light without its own slice, interpolation the light on both sides.
    absl::Status status;
    if (traversal.interpolate) {
      CopyLightBuffer(buffers.before, buffers.after);
      status = deposit();
      if (status.ok()) status = draw();
      std::swap(buffers.before, buffers.after);
    } else {
      status = draw();
      if (status.ok()) status = deposit();
    }
    if (!status.ok()) return status;
    if (traversal.keep_layers) {
      context.readback.Copy(buffers.before.texture,
                            {.image = shadow.light_layers, .layer = static_cast<int>(s)});
    }
  }
  if (traversal.keep_light_buffer) {
    // The buffer stands at the middle of the last slice; shown is the light behind all particles.
    if (traversal.blur) {
      if (absl::Status status = blur(order.slice_position.back(), order.end_position);
          !status.ok()) {
        return status;
      }
    }
    shadow.light_buffer = DescribeLightImage(traversal, 1);
    context.readback.Copy(buffers.before.texture, {shadow.light_buffer});
  }
  return absl::OkStatus();
}

}  // namespace

HalfAngleAxis ComputeHalfAngleAxis(const glm::dvec3& view, const glm::dvec3& light) {
  if (glm::dot(view, light) > 0.0) return {glm::normalize(view + light), false};
  return {glm::normalize(light - view), true};
}

Traversal PlanHalfAngleLight(const Scene& scene, const ParticleView& particles, int light) {
  const Light& source = scene.lights[static_cast<size_t>(light)];
  const HalfAngleAxis half_angle =
      ComputeHalfAngleAxis(ViewDirection(scene.camera), TravelDirection(source, particles));
  Traversal traversal = PlanLightBuffer(scene, particles, light);
  traversal.axis = half_angle.axis;
  traversal.back_to_front = half_angle.back_to_front;
  traversal.in_tiles = scene.shadow.compositor == SliceCompositor::kTiles;
  traversal.interpolate = scene.shadow.interpolate;
  return traversal;
}

absl::StatusOr<std::shared_ptr<const DeviceOrder>> SortForTraversal(
    const TraversalContext& context) {
  const Traversal& traversal = context.traversal;
  bool made = false;
  auto order = OrderOnDevice(context.cache, context.scene, context.particles, traversal,
                             context.eye.projection.eye() - context.particles.set().origin, made);
  if (!made) context.reused.push_back(DescribeSort(traversal));
  return order;
}

PlannedPass DescribeSort(const Traversal& traversal) {
  if (!traversal.shadow_light) {
    return {traversal.axis ? "sort by depth" : "sort by distance from the eye",
            "nothing casts shadows", 1};
  }
  return {traversal.back_to_front ? "sort along the half vector, back to front"
                                  : "sort along the half vector, front to back",
          absl::StrCat("light ", *traversal.shadow_light, " casts shadows"), 1};
}

std::vector<PlannedPass> DescribeHalfAnglePasses(const Traversal& traversal) {
  const std::string light = absl::StrCat("light ", *traversal.shadow_light, " casts shadows");
  const int slices = traversal.slices;
  std::vector<PlannedPass> passes = {
      DescribeSort(traversal),
      {"project particles for the eye", "every traversal", 1},
      {"project particles for the light", light, 1},
  };
  if (traversal.blur) passes.push_back({"blur light buffer", "the light scatters", slices - 1});
  if (traversal.interpolate && !traversal.in_tiles) {
    passes.push_back({"copy light buffer", "interpolation within slices", slices});
  }
  passes.push_back({"deposit slice into light buffer", light, slices});
  passes.push_back(traversal.in_tiles ? DescribeCompositeInTiles()
                                      : PlannedPass{"composite slice", "the image", slices});
  if (traversal.keep_layers) passes.push_back({"read back layer", "light layers wanted", slices});
  return passes;
}

absl::Status DrawHalfAngleLight(const TraversalContext& context, LightReport& report,
                                ShadowResult& shadow) {
  const Traversal& traversal = context.traversal;
  const Light& source = context.scene.lights[static_cast<size_t>(*traversal.shadow_light)];
  Gpu& gpu = context.gpu;

  // Sort the particles along the axis, and fit the light's camera to them.
  context.clock.BeginCpu("sort");
  const auto sorted = SortForTraversal(context);
  if (!sorted.ok()) return sorted.status();
  const DeviceOrder& order = **sorted;
  context.clock.BeginCpu("light camera");
  std::optional<LightSpread> spread;
  if (traversal.blur) spread.emplace(context.scene, source, context.particles, *traversal.axis);
  Projection light_projection = LightProjection(
      source, context.particles, traversal.light_buffer_size, spread ? spread->Border() : 0.0);
  light_projection.optical_depth_scale = ForwardExtinction(context.scene.material);
  report = ReportOf(light_projection);
  report.slice_axis = *traversal.axis;
  report.slices = traversal.slices;
  report.back_to_front = traversal.back_to_front;

  // Project them for the eye and for the light.
  context.clock.BeginGpu("project");
  const TargetProjection light = UploadProjection(light_projection, context.particles);
  absl::StatusOr<gl::Buffer> eye_splats =
      ProjectParticles(gpu, context.buffers, order, context.eye, "project particles for the eye");
  if (!eye_splats.ok()) return eye_splats.status();
  absl::StatusOr<gl::Buffer> light_splats =
      ProjectParticles(gpu, context.buffers, order, light, "project particles for the light");
  if (!light_splats.ok()) return light_splats.status();

  // Walk the slices: let the light spread up to each, deposit it, draw it.
  const CompositePass composite =
      PrepareComposite(context.scene, traversal, order, context.buffers, context.eye.projection,
                       *eye_splats, &light, &*light_splats, context.targets.front());
  const glm::dvec2 texels_per_unit = TexelsPerUnit(light_projection, context.particles);
  const SlicedLight sliced{
      .order = order,
      .light = light,
      .splats = *light_splats,
      .composite = composite,
      .channels = ChannelsOf(traversal),
      .blur =
          [&](double from, double to, LightBuffer& buffer, LightBuffer& scratch) {
            return BlurLightBuffer(gpu, buffer, scratch,
                                   spread->InTexels(from, to, texels_per_unit),
                                   source.shadow_density, ChannelsOf(traversal));
          },
  };
  return traversal.in_tiles ? DrawSlicesInTiles(context, sliced, shadow)
                            : DrawSlicesByBlending(context, sliced, shadow);
}

}  // namespace halflight
