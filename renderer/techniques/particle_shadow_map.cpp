#include "renderer/techniques/particle_shadow_map.h"

#include "renderer/sweep/cpu_frame.h"

namespace halflight {

namespace {

constexpr char kName[] = "PARTICLE_SHADOW_MAP";

}  // namespace

absl::Status ParticleShadowMap::Check(const FrameRequest& request) const {
  return sweep::CheckSizes(request, kName);
}

absl::Status ParticleShadowMap::Plan(const FrameRequest& request, const ParticleView& particles,
                                     FramePlan& plan) const {
  return sweep::PlanFrame(request, particles, kName, plan);
}

absl::StatusOr<DrawnFrame> ParticleShadowMap::Draw(const DrawContext& context) const {
  return sweep::DrawOnCpu(context);
}

}  // namespace halflight
