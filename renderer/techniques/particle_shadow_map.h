// Particle shadow maps: layers of optical depth at uniform distances along each light, between
// which a particle sees the light interpolated to its own depth, its own contribution left out;
// fitted over its footprint and composited as the light sweep does. On the CPU; holds one layer at
// a time. Refuses a shadow-casting light among the particles.
#pragma once

#include "renderer/shadow_technique.h"

namespace halflight {

class ParticleShadowMap : public ShadowTechnique {
 public:
  [[nodiscard]] absl::Status Check(const FrameRequest& request) const override;
  absl::Status Plan(const FrameRequest& request, const ParticleView& particles,
                    FramePlan& plan) const override;
  [[nodiscard]] bool DrawsOnDevice(const FrameRequest& /*request*/,
                                   const DeviceInfo& /*device*/) const override {
    return false;
  }
  [[nodiscard]] absl::StatusOr<DrawnFrame> Draw(const DrawContext& context) const override;
};

}  // namespace halflight
