#include "renderer/techniques/half_angle.h"

#include <utility>

#include "absl/strings/str_cat.h"
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
      plan.passes.push_back({traversal.axis ? "sort by depth" : "sort by distance from the eye",
                             "nothing casts shadows", 1});
      plan.passes.push_back({"project particles for the eye", "every traversal", 1});
      plan.passes.push_back({"composite", "the image", 1});
    }
  }
}

absl::Status CheckTargetSize(const FramePlan& plan, const DeviceInfo& device) {
  for (const int side : {plan.composite_size.x, plan.composite_size.y}) {
    if (side > device.max_texture_size) {
      return absl::InvalidArgumentError(absl::StrCat("camera size times sampling: ", side,
                                                     " pixels, allowed on ", device.gl_renderer,
                                                     ": at most ", device.max_texture_size));
    }
  }
  for (const Traversal& traversal : plan.traversals) {
    if (traversal.light_buffer_size > device.max_texture_size) {
      return absl::InvalidArgumentError(
          absl::StrCat("shadow.light_buffer_size: ", traversal.light_buffer_size, ", allowed on ",
                       device.gl_renderer, ": at most ", device.max_texture_size));
    }
  }
  return absl::OkStatus();
}

absl::Status DrawUnshadowed(const TraversalContext& context) {
  context.clock.BeginCpu("sort");
  const ParticleOrder order =
      OrderParticles(context.particles, context.traversal,
                     context.eye.projection.eye() - context.particles.set().origin);
  context.clock.BeginGpu("project");
  const OrderBuffers order_buffers = UploadOrder(order);
  absl::StatusOr<gl::Buffer> splats = ProjectParticles(
      context.gpu, context.buffers, order_buffers, context.eye, "project particles for the eye");
  if (!splats.ok()) return splats.status();
  context.clock.BeginGpu("light and composite");
  const CompositePass composite =
      PrepareComposite(context.scene, context.traversal, order_buffers, context.buffers,
                       context.eye, *splats, nullptr, nullptr, context.target);
  return CompositeSlice(context.gpu, composite, 0, static_cast<uint32_t>(order.particles.size()),
                        nullptr, context.target);
}

// Reads a target back, resolved to the image's size where sampling asks for it.
absl::StatusOr<Image> ReadResolved(Gpu& gpu, const gl::Texture& samples, const Sampling& sampling,
                                   const FramePlan& plan) {
  if (sampling.supersample == 1 && sampling.downsample == 1) return ReadTexture(samples);
  absl::StatusOr<gl::Texture> pixels = ResolveSamples(gpu, samples, sampling, plan.window_size);
  if (!pixels.ok()) return pixels.status();
  return ReadTexture(*pixels);
}

// Draws one traversal and reads back what it adds to the frame.
absl::Status DrawTraversal(const TraversalContext& context, const FramePlan& plan,
                           std::vector<LightReport>& reports, DrawnImages& drawn) {
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
  const Sampling& sampling = context.scene.sampling;
  absl::StatusOr<Image> image = ReadResolved(context.gpu, context.target.image, sampling, plan);
  if (!image.ok()) return image.status();
  if (drawn.beauty.pixels.empty()) {
    drawn.beauty = *std::move(image);
  } else {
    AddColors(*image, drawn.beauty);
  }
  if (context.target.depth) {
    absl::StatusOr<Image> depth = ReadResolved(context.gpu, context.target.depth, sampling, plan);
    if (!depth.ok()) return depth.status();
    drawn.depth = *std::move(depth);
  }
  if (context.target.transmittance) {
    absl::StatusOr<Image> transmittance =
        ReadResolved(context.gpu, context.target.transmittance, sampling, plan);
    if (!transmittance.ok()) return transmittance.status();
    drawn.transmittance[static_cast<size_t>(*traversal.shadow_light)] = *std::move(transmittance);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status HalfAngle::Plan(const FrameRequest& request, const ParticleView& particles,
                             FramePlan& plan) const {
  const Scene& scene = request.scene;
  if (absl::Status status = CheckLightCount(scene); !status.ok()) return status;

  // One traversal for each light that casts shadows: each has an axis of its own.
  std::vector<int> unshadowed;
  for (int light = 0; light < static_cast<int>(scene.lights.size()); ++light) {
    if (!scene.lights[static_cast<size_t>(light)].casts_shadows()) {
      unshadowed.push_back(light);
      continue;
    }
    absl::StatusOr<Traversal> traversal = PlanHalfAngleLight(scene, particles, light);
    if (!traversal.ok()) return traversal.status();
    traversal->shadow_light = light;
    KeepWhatOutputsShow(request.images, *traversal);
    plan.traversals.push_back(*std::move(traversal));
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
  if (absl::Status status = CheckTargetSize(plan, context.device); !status.ok()) return status;
  gl::ForgetErrors();

  // Bring particles and camera to the device.
  context.clock.BeginCpu("upload");
  const ParticleBuffers buffers = UploadParticles(context.particles);
  const double samples = static_cast<double>(scene.sampling.supersample) /
                         static_cast<double>(scene.sampling.downsample);
  Projection eye_projection = EyeProjection(scene.camera, plan.composite_size, samples);
  eye_projection.near_eye = ReachesEyePlane(eye_projection, context.particles);
  const TargetProjection eye = UploadProjection(eye_projection, context.particles);

  // Walk over the particles once for each light that casts shadows, and add up the light.
  DrawnImages drawn;
  drawn.transmittance.resize(scene.lights.size());
  drawn.shadows.resize(scene.lights.size());
  std::vector<LightReport> reports(scene.lights.size());
  for (size_t t = 0; t < plan.traversals.size(); ++t) {
    if (context.stop.stop_requested()) return absl::CancelledError("frame cancelled");
    const Traversal& traversal = plan.traversals[t];
    context.clock.BeginGpu("clear");
    const CompositeTarget target = MakeCompositeTarget(
        plan.composite_size, plan.keep_depth && t == 0, traversal.keep_transmittance);
    const TraversalContext walk{context.gpu, scene,  traversal,     context.particles, buffers,
                                eye,         target, context.clock, context.stop};
    if (absl::Status status = DrawTraversal(walk, plan, reports, drawn); !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = gl::CheckErrors("frame"); !status.ok()) return status;

  context.clock.BeginCpu("images");
  return DrawnFrame{SelectImages(context.request, drawn), std::move(reports)};
}

}  // namespace halflight
