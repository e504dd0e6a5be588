#include "renderer/techniques/half_angle.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/bands.h"
#include "renderer/field_error.h"
#include "renderer/frame_engine.h"
#include "renderer/frame_images.h"
#include "renderer/gl/debug.h"
#include "renderer/gpu.h"
#include "renderer/passes/composite.h"
#include "renderer/passes/project.h"
#include "renderer/passes/resolve.h"
#include "renderer/techniques/half_angle_light.h"
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
      plan.passes.push_back({"composite", "the image", 1});
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
  context.clock.BeginGpu("light and composite");
  const CompositePass composite =
      PrepareComposite(context.scene, context.traversal, **order, context.buffers,
                       context.eye.projection, *splats, nullptr, nullptr, context.targets.front());
  return CompositeSlice(context.gpu, composite, 0, (*order)->count(), nullptr, context.targets);
}

// Reads one texture of every band back, resolved where sampling asks for it, as one image.
absl::StatusOr<Image> ReadBands(const TraversalContext& context, const FramePlan& plan,
                                const std::vector<Band>& bands,
                                gl::Texture CompositeTarget::*texture) {
  const Sampling& sampling = context.scene.sampling;
  Image image{plan.window_size.x, plan.window_size.y, 1, {"R", "G", "B", "A"}, {}};
  for (size_t b = 0; b < bands.size(); ++b) {
    const gl::Texture& samples = context.targets[b].*texture;
    gl::Texture resolved;
    if (sampling.supersample > 1 || sampling.downsample > 1) {
      absl::StatusOr<gl::Texture> pixels =
          ResolveSamples(context.gpu, samples, sampling, bands[b], plan.composite_size);
      if (!pixels.ok()) return pixels.status();
      resolved = *std::move(pixels);
    }
    Image part = ReadTexture(resolved ? resolved : samples);
    if (bands.size() == 1) return part;
    image.pixels.resize(size_t{4} * static_cast<size_t>(image.width) *
                        static_cast<size_t>(image.height));
    CopyBand(part, bands[b], image);
  }
  return image;
}

// Draws one traversal and reads back what it adds to the frame.
absl::Status DrawTraversal(const TraversalContext& context, const FramePlan& plan,
                           const std::vector<Band>& bands, std::vector<LightReport>& reports,
                           DrawnImages& drawn) {
  const Traversal& traversal = context.traversal;
  if (traversal.shadow_light) {
    const auto light = static_cast<size_t>(*traversal.shadow_light);
    absl::StatusOr<ShadowResult> shadow = DrawHalfAngleLight(context, reports[light]);
    if (!shadow.ok()) return shadow.status();
    drawn.shadows[light] = *std::move(shadow);
  } else if (absl::Status status = DrawUnshadowed(context); !status.ok()) {
    return status;
  }

  context.clock.BeginCpu("readback");
  absl::StatusOr<Image> image = ReadBands(context, plan, bands, &CompositeTarget::image);
  if (!image.ok()) return image.status();
  if (drawn.beauty.pixels.empty()) {
    drawn.beauty = *std::move(image);
  } else {
    AddColors(*image, drawn.beauty);
  }
  if (context.targets.front().depth) {
    absl::StatusOr<Image> depth = ReadBands(context, plan, bands, &CompositeTarget::depth);
    if (!depth.ok()) return depth.status();
    drawn.depth = *std::move(depth);
  }
  if (context.targets.front().transmittance) {
    absl::StatusOr<Image> transmittance =
        ReadBands(context, plan, bands, &CompositeTarget::transmittance);
    if (!transmittance.ok()) return transmittance.status();
    drawn.transmittance[static_cast<size_t>(*traversal.shadow_light)] = *std::move(transmittance);
  }
  return absl::OkStatus();
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
    traversal.shadow_light = light;
    KeepWhatOutputsShow(request.images, traversal);
    plan.traversals.push_back(std::move(traversal));
  }
  // Without shadows: one walk in the order of distance from the eye, as the image model asks; of
  // parallel rays, each from an eye of its own, that is the depth along them.
  if (plan.traversals.empty()) {
    plan.traversals.emplace_back();
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
  gl::ForgetErrors();

  // Bring particles and camera to the device.
  context.clock.BeginCpu("upload");
  const auto buffers = ParticlesOnDevice(context.cache, scene, context.particles);
  if (!buffers.ok()) return buffers.status();
  Projection eye_projection = EyeProjection(scene, plan.composite_size);
  eye_projection.near_eye = ReachesEyePlane(eye_projection, context.particles);
  const TargetProjection eye = UploadProjection(eye_projection, context.particles);

  // Walk over the particles once for each light that casts shadows, and add up the light.
  DrawnImages drawn;
  drawn.transmittance.resize(scene.lights.size());
  drawn.shadows.resize(scene.lights.size());
  DrawnFrame frame;
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
                                .cache = context.cache,
                                .scene = scene,
                                .traversal = traversal,
                                .particles = context.particles,
                                .buffers = **buffers,
                                .eye = eye,
                                .targets = targets,
                                .reused = frame.reused,
                                .clock = context.clock,
                                .stop = context.stop};
    if (absl::Status status = DrawTraversal(walk, plan, bands, frame.reports, drawn);
        !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = gl::CheckErrors("frame"); !status.ok()) return status;

  context.clock.BeginCpu("images");
  frame.images = SelectImages(context.request, std::move(drawn));
  return frame;
}

}  // namespace halflight
