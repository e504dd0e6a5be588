#include "renderer/techniques/half_angle.h"

#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/bands.h"
#include "renderer/field_error.h"
#include "renderer/frame_engine.h"
#include "renderer/gl/debug.h"
#include "renderer/gpu.h"
#include "renderer/passes/composite.h"
#include "renderer/passes/project.h"
#include "renderer/passes/resolve.h"
#include "renderer/readback.h"
#include "renderer/techniques/half_angle_light.h"
#include "renderer/techniques/half_angle_tiles.h"
#include "renderer/techniques/traversal_context.h"

namespace halflight {

namespace {

// What the outputs ask of a shadow-casting light's traversal.
void KeepWhatOutputsShow(const std::vector<ImageRequest>& images, Traversal& traversal) {
  for (const ImageRequest& image : images) {
    if (image.light_index != traversal.shadow_light) continue;
    traversal.keep_transmittance |= image.kind == ImageKind::kLightTransmittance;
    traversal.keep_light_buffer |= image.kind == ImageKind::kLightBuffer;
    traversal.keep_layers |= image.kind == ImageKind::kLightLayers;
  }
}

void DescribePasses(FramePlan& plan) {
  for (const Traversal& traversal : plan.traversals) {
    if (traversal.shadow_light) {
      for (PlannedPass& pass : DescribeHalfAnglePasses(traversal)) {
        plan.passes.push_back(std::move(pass));
      }
    } else {
      plan.passes.push_back(DescribeSort(traversal));
      plan.passes.push_back({"project particles for the eye", "every traversal", 1});
      plan.passes.push_back(traversal.in_tiles ? DescribeCompositeInTiles()
                                               : PlannedPass{"composite", "the image", 1});
    }
  }
}

absl::Status CheckLightBuffers(const FramePlan& plan, const DeviceInfo& device) {
  for (const Traversal& traversal : plan.traversals) {
    if (traversal.light_buffer_size > device.max_texture_size) {
      return FieldError("shadow.light_buffer_size", absl::StrCat(traversal.light_buffer_size),
                        absl::StrCat("at most ", device.max_texture_size),
                        " on " + device.gl_renderer);
    }
  }
  return absl::OkStatus();
}

absl::Status DrawUnshadowed(const TraversalContext& context) {
  context.clock.BeginCpu("sort");
  const auto order = SortForTraversal(context);
  if (!order.ok()) return order.status();
  context.clock.BeginGpu("project");
  absl::StatusOr<gl::Buffer> splats = ProjectParticles(
      context.gpu, context.buffers, **order, context.eye, "project particles for the eye");
  if (!splats.ok()) return splats.status();
  const CompositePass composite =
      PrepareComposite(context.scene, context.traversal, **order, context.buffers,
                       context.eye.projection, *splats, nullptr, nullptr, context.targets.front());
  if (context.traversal.in_tiles) return DrawUnshadowedInTiles(context, composite);
  context.clock.BeginGpu("light and composite");
  const uint32_t count = (*order)->count();
  return context.pieces.Draw(context.pieces.CostsOf(*splats, count, context.eye.projection.size), 0,
                             count, context.stop, [&](uint32_t begin, uint32_t end) {
                               return CompositeSlice(context.gpu, composite, begin, end, nullptr,
                                                     context.targets);
                             });
}

// Reads one texture of every band back, resolved where sampling asks for it, into one image; `add`:
// to what other traversals brought there.
absl::Status ReadBands(const TraversalContext& context, const FramePlan& plan,
                       const std::vector<Band>& bands, gl::Texture CompositeTarget::*texture,
                       Image& image, bool add = false) {
  const Sampling& sampling = context.scene.sampling;
  image = {
      plan.window_size.x, plan.window_size.y, 1, {"R", "G", "B", "A"}, std::move(image.pixels)};
  for (size_t b = 0; b < bands.size(); ++b) {
    const gl::Texture& samples = context.targets[b].*texture;
    gl::Texture resolved;
    if (sampling.supersample > 1 || sampling.downsample > 1) {
      absl::StatusOr<gl::Texture> pixels =
          ResolveSamples(context.gpu, samples, sampling, bands[b], plan.composite_size);
      if (!pixels.ok()) return pixels.status();
      resolved = *std::move(pixels);
    }
    const PixelRect& pixels = bands[b].pixels;
    context.readback.Copy(resolved ? resolved : samples,
                          {.image = image, .at = {pixels.x, pixels.y}, .add = add});
  }
  return absl::OkStatus();
}

// Draws one traversal and has read back what it adds to the frame.
absl::Status DrawTraversal(const TraversalContext& context, const FramePlan& plan,
                           const std::vector<Band>& bands, std::vector<LightReport>& reports,
                           DrawnImages& drawn) {
  const Traversal& traversal = context.traversal;
  if (traversal.shadow_light) {
    const auto light = static_cast<size_t>(*traversal.shadow_light);
    absl::Status status = DrawHalfAngleLight(context, reports[light], drawn.shadows[light]);
    if (!status.ok()) return status;
  } else if (absl::Status status = DrawUnshadowed(context); !status.ok()) {
    return status;
  }

  context.readback.BeginStage(context.clock);
  const bool first = &traversal == &plan.traversals.front();
  absl::Status status =
      ReadBands(context, plan, bands, &CompositeTarget::image, drawn.beauty, !first);
  if (status.ok() && context.targets.front().depth) {
    status = ReadBands(context, plan, bands, &CompositeTarget::depth, drawn.depth);
  }
  if (status.ok() && context.targets.front().transmittance) {
    status = ReadBands(context, plan, bands, &CompositeTarget::transmittance,
                       drawn.transmittance[static_cast<size_t>(*traversal.shadow_light)]);
  }
  return status;
}

}  // namespace

absl::Status HalfAngle::Check(const FrameRequest& request) const {
  return CheckLightCount(request.scene);
}

absl::Status HalfAngle::Plan(const FrameRequest& request, const ParticleView& particles,
                             FramePlan& plan) const {
  const Scene& scene = request.scene;
  if (absl::Status status = CheckLightsOutside(scene, particles, "HALF_ANGLE"); !status.ok()) {
    return status;
  }

  // One traversal for each light that casts shadows: each has an axis of its own.
  std::vector<int> unshadowed;
  for (int light = 0; light < static_cast<int>(scene.lights.size()); ++light) {
    if (!scene.lights[static_cast<size_t>(light)].casts_shadows()) {
      unshadowed.push_back(light);
      continue;
    }
    Traversal traversal = PlanHalfAngleLight(scene, particles, light);
    KeepWhatOutputsShow(request.images, traversal);
    plan.traversals.push_back(std::move(traversal));
  }
  // Without shadows: one walk in the order of distance from the eye, as the image model asks; of
  // parallel rays, each from an eye of its own, that is the depth along them.
  if (plan.traversals.empty()) {
    plan.traversals.emplace_back();
    plan.traversals.front().in_tiles = scene.shadow.compositor == SliceCompositor::kTiles;
    if (std::holds_alternative<Orthographic>(scene.camera.projection)) {
      plan.traversals.front().axis = ViewDirection(scene.camera);
    }
  }
  plan.traversals.front().ambient_and_emission = true;
  plan.traversals.front().unshadowed_lights = std::move(unshadowed);

  DescribePasses(plan);
  return absl::OkStatus();
}

absl::StatusOr<DrawnFrame> HalfAngle::Draw(const DrawContext& context) const {
  const Scene& scene = context.request.scene;
  const FramePlan& plan = context.plan;
  if (absl::Status status = CheckLightBuffers(plan, context.device); !status.ok()) return status;

  // Bring particles and camera to the device.
  context.clock.BeginCpu("upload");
  const auto buffers = ParticlesOnDevice(context.cache, scene, context.particles);
  if (!buffers.ok()) return buffers.status();
  Projection eye_projection = EyeProjection(scene, plan.composite_size);
  eye_projection.near_eye = ReachesEyePlane(eye_projection, context.particles);
  const TargetProjection eye = UploadProjection(eye_projection, context.particles);

  // Walk over the particles once for each light that casts shadows, and add up the light.
  DrawnFrame frame;
  frame.arriving = std::make_unique<ArrivingImages>(context.staging);
  DrawnImages& drawn = frame.arriving->drawn;
  drawn.transmittance.resize(scene.lights.size());
  drawn.shadows.resize(scene.lights.size());
  frame.reports.resize(scene.lights.size());
  const std::vector<Band> bands = CutIntoBands(plan.window_size, plan.composite_size,
                                               scene.sampling, context.device.max_texture_size);
  for (size_t t = 0; t < plan.traversals.size(); ++t) {
    if (context.stop.stop_requested()) return absl::CancelledError("frame cancelled");
    const Traversal& traversal = plan.traversals[t];
    context.clock.BeginGpu("clear");
    std::vector<CompositeTarget> targets;
    for (const Band& band : bands) {
      targets.push_back(MakeCompositeTarget(eye_projection, context.particles, band.samples,
                                            plan.keep_depth && t == 0,
                                            traversal.keep_transmittance));
    }
    const TraversalContext walk{.gpu = context.gpu,
                                .device = context.device,
                                .cache = context.cache,
                                .pieces = context.pieces,
                                .scene = scene,
                                .traversal = traversal,
                                .particles = context.particles,
                                .buffers = **buffers,
                                .eye = eye,
                                .targets = targets,
                                .reused = frame.reused,
                                .readback = frame.arriving->readback,
                                .clock = context.clock,
                                .stop = context.stop};
    if (absl::Status status = DrawTraversal(walk, plan, bands, frame.reports, drawn);
        !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = gl::CheckErrors("frame"); !status.ok()) return status;
  return frame;
}

}  // namespace halflight
