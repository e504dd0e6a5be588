#include "renderer/frame_renderer.h"

#include <algorithm>
#include <utility>

#include "renderer/particle_view.h"
#include "renderer/shadow_technique.h"
#include "renderer/stage_clock.h"

namespace halflight {

namespace {

// Passes whose work an earlier frame left are not run.
void MarkReused(const std::vector<PlannedPass>& reused, FramePlan& plan) {
  for (PlannedPass& pass : plan.passes) {
    if (std::find(reused.begin(), reused.end(), pass) == reused.end()) continue;
    pass.reason += ": kept from an earlier frame";
    pass.count = 0;
  }
}

}  // namespace

FrameRenderer::FrameRenderer(std::unique_ptr<gl::EglContext> context,
                             const FrameRendererOptions& options)
    : context_(std::move(context)), device_(context_->device()), cache_(options.max_reuse_bytes) {
  device_.max_texture_size = std::min(device_.max_texture_size, options.max_texture_size);
}

absl::StatusOr<std::unique_ptr<FrameRenderer>> FrameRenderer::Create(
    const std::string& device, const FrameRendererOptions& options) {
  absl::StatusOr<std::unique_ptr<gl::EglContext>> context = gl::EglContext::Create(device);
  if (!context.ok()) return context.status();
  return std::unique_ptr<FrameRenderer>(new FrameRenderer(*std::move(context), options));
}

absl::StatusOr<FrameResult> FrameRenderer::Render(const FrameRequest& request,
                                                  const std::stop_token& stop) {
  StageClock clock;
  clock.BeginCpu("plan");
  // What the request leaves to the device.
  FrameRequest settled = request;
  settled.scene.shadow.compositor =
      CompositorFor(request.scene.shadow.compositor, device().software);
  const Scene& scene = request.scene;
  cache_.ForgetGoneSets();
  FrameCache nothing_kept(0);
  FrameCache& cache = request.reuse ? cache_ : nothing_kept;
  const auto particles =
      cache.FindOrMake(scene.particles, ParticleViewKeyOf(scene),
                       [&]() -> absl::StatusOr<ParticleView> { return ParticleView(scene); });
  if (!particles.ok()) return particles.status();
  absl::StatusOr<FramePlan> plan = PlanFrame(settled, **particles);
  if (!plan.ok()) return plan.status();
  const DrawContext context{.gpu = gpu_,
                            .device = device(),
                            .cache = cache,
                            .request = settled,
                            .particles = **particles,
                            .plan = *plan,
                            .clock = clock,
                            .stop = stop};
  const ShadowTechnique& technique = TechniqueFor(scene.shadow.technique);
  absl::StatusOr<DrawnFrame> drawn = technique.Draw(context);
  if (absl::IsResourceExhausted(drawn.status()) && !cache_.empty()) {
    // What was kept may be what there is no room beside.
    cache_.Clear();
    drawn = technique.Draw(context);
  }
  if (!drawn.ok()) return drawn.status();
  MarkReused(drawn->reused, *plan);
  FrameResult result;
  result.images = std::move(drawn->images);
  result.plan = *std::move(plan);
  result.lights = std::move(drawn->reports);
  result.clamped_opacities = (*particles)->clamped_opacities();
  result.timings = clock.Finish();
  return result;
}

}  // namespace halflight
