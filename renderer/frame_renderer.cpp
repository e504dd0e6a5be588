#include "renderer/frame_renderer.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "renderer/frame_images.h"
#include "renderer/gl/debug.h"
#include "renderer/passes/composite.h"
#include "renderer/passes/project.h"
#include "renderer/passes/resolve.h"
#include "renderer/reference_frame.h"
#include "renderer/shadow_technique.h"
#include "renderer/sweep/sweep_frame.h"
#include "renderer/traversal_context.h"

namespace halflight {

namespace {

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
    absl::StatusOr<ShadowResult> shadow =
        TechniqueFor(context.scene.shadow.technique).Draw(context, reports[light]);
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

// Makes the images that were asked for.
FrameResult FinishFrame(const FrameRequest& request, const DrawnImages& drawn, FramePlan plan,
                        std::vector<LightReport> reports, const ParticleView& particles,
                        StageClock& clock) {
  clock.BeginCpu("images");
  FrameResult result;
  for (const ImageRequest& image : request.images) {
    result.images.push_back(SelectImage(image, request.scene, drawn));
  }
  result.plan = std::move(plan);
  result.lights = std::move(reports);
  result.clamped_opacities = particles.clamped_opacities();
  result.timings = clock.Finish();
  return result;
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameRenderer>> FrameRenderer::Create(const std::string& device) {
  absl::StatusOr<std::unique_ptr<gl::EglContext>> context = gl::EglContext::Create(device);
  if (!context.ok()) return context.status();
  return std::unique_ptr<FrameRenderer>(new FrameRenderer(*std::move(context)));
}

absl::StatusOr<FrameResult> FrameRenderer::Render(const FrameRequest& request,
                                                  const std::stop_token& stop) {
  const Scene& scene = request.scene;
  StageClock clock;

  // Decide what the frame needs.
  clock.BeginCpu("plan");
  const ParticleView particles(scene);
  absl::StatusOr<FramePlan> plan = PlanFrame(request, particles);
  if (!plan.ok()) return plan.status();
  if (scene.shadow.technique == ShadowTechniqueKind::kReference) {
    clock.BeginCpu("reference");
    absl::StatusOr<FrameResult> result = RenderReferenceFrame(request, stop);
    if (!result.ok()) return result.status();
    result->plan = *std::move(plan);
    result->clamped_opacities = particles.clamped_opacities();
    result->timings = clock.Finish();
    return result;
  }
  if (scene.shadow.technique == ShadowTechniqueKind::kLightSweep) {
    std::vector<LightReport> reports(scene.lights.size());
    absl::StatusOr<DrawnImages> drawn =
        DrawSweepFrame(request, particles, *plan, clock, stop, reports);
    if (!drawn.ok()) return drawn.status();
    return FinishFrame(request, *drawn, *std::move(plan), std::move(reports), particles, clock);
  }
  if (absl::Status status = CheckTargetSize(*plan, device()); !status.ok()) return status;
  gl::ForgetErrors();

  // Bring particles and camera to the device.
  clock.BeginCpu("upload");
  const ParticleBuffers buffers = UploadParticles(particles);
  const double samples = static_cast<double>(scene.sampling.supersample) /
                         static_cast<double>(scene.sampling.downsample);
  Projection eye_projection = EyeProjection(scene.camera, plan->composite_size, samples);
  eye_projection.near_eye = ReachesEyePlane(eye_projection, particles);
  const TargetProjection eye = UploadProjection(eye_projection, particles);

  // Walk over the particles once for each light that casts shadows, and add up the light.
  DrawnImages drawn;
  drawn.transmittance.resize(scene.lights.size());
  drawn.shadows.resize(scene.lights.size());
  std::vector<LightReport> reports(scene.lights.size());
  for (size_t t = 0; t < plan->traversals.size(); ++t) {
    if (stop.stop_requested()) return absl::CancelledError("frame cancelled");
    const Traversal& traversal = plan->traversals[t];
    clock.BeginGpu("clear");
    const CompositeTarget target = MakeCompositeTarget(
        plan->composite_size, plan->keep_depth && t == 0, traversal.keep_transmittance);
    const TraversalContext context{gpu_, scene,  traversal, particles, buffers,
                                   eye,  target, clock,     stop};
    if (absl::Status status = DrawTraversal(context, *plan, reports, drawn); !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = gl::CheckErrors("frame"); !status.ok()) return status;

  return FinishFrame(request, drawn, *std::move(plan), std::move(reports), particles, clock);
}

}  // namespace halflight
