// Frames of half-angle slicing: a traversal of the particles for each light that casts shadows
// (half_angle_light.h), whose light adds up; one in the order of distance where none does.
#pragma once

#include "renderer/shadow_technique.h"

namespace halflight {

class HalfAngle : public ShadowTechnique {
 public:
  [[nodiscard]] absl::Status Check(const FrameRequest& request) const override;
  absl::Status Plan(const FrameRequest& request, const ParticleView& particles,
                    FramePlan& plan) const override;
  [[nodiscard]] bool DrawsOnDevice(const FrameRequest& /*request*/,
                                   const DeviceInfo& /*device*/) const override {
    return true;
  }
  [[nodiscard]] absl::StatusOr<DrawnFrame> Draw(const DrawContext& context) const override;
};

}  // namespace halflight
