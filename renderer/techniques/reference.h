// Frames of the image model itself, evaluated on the CPU in place of all passes
// (renderer/reference). Uses all cores and no GL. Refuses what the model has not: scattering, light
// buffers, samples fewer than pixels.
#pragma once

#include "renderer/shadow_technique.h"

namespace halflight {

class Reference : public ShadowTechnique {
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
