#include "renderer/frame_renderer.h"

#include <utility>

#include "renderer/shadow_technique.h"
#include "renderer/stage_clock.h"

namespace halflight {

absl::StatusOr<std::unique_ptr<FrameRenderer>> FrameRenderer::Create(const std::string& device) {
  absl::StatusOr<std::unique_ptr<gl::EglContext>> context = gl::EglContext::Create(device);
  if (!context.ok()) return context.status();
  return std::unique_ptr<FrameRenderer>(new FrameRenderer(*std::move(context)));
}

absl::StatusOr<FrameResult> FrameRenderer::Render(const FrameRequest& request,
                                                  const std::stop_token& stop) {
  StageClock clock;
  clock.BeginCpu("plan");
  const ParticleView particles(request.scene);
  absl::StatusOr<FramePlan> plan = PlanFrame(request, particles);
  if (!plan.ok()) return plan.status();
  absl::StatusOr<DrawnFrame> drawn = TechniqueFor(request.scene.shadow.technique)
                                         .Draw({.gpu = gpu_,
                                                .device = device(),
                                                .request = request,
                                                .particles = particles,
                                                .plan = *plan,
                                                .clock = clock,
                                                .stop = stop});
  if (!drawn.ok()) return drawn.status();
  FrameResult result;
  result.images = std::move(drawn->images);
  result.plan = *std::move(plan);
  result.lights = std::move(drawn->reports);
  result.clamped_opacities = particles.clamped_opacities();
  result.timings = clock.Finish();
  return result;
}

}  // namespace halflight
