// Frames of the light sweep: particles in their exact order along each light, shadows fitted over
// every footprint, the image composited front to back tile by tile. On a GPU, or on the CPU with
// all cores and no GL: see SweepOn. Where light scatters or light layers are shown the order along
// the light is cut into slabs, on the CPU alone. Refuses a shadow-casting light among the
// particles.
#pragma once

#include "renderer/shadow_technique.h"

namespace halflight {

class LightSweep : public ShadowTechnique {
 public:
  [[nodiscard]] absl::Status Check(const FrameRequest& request) const override;
  absl::Status Plan(const FrameRequest& request, const ParticleView& particles,
                    FramePlan& plan) const override;
  [[nodiscard]] bool DrawsOnDevice(const FrameRequest& request,
                                   const DeviceInfo& device) const override;
  [[nodiscard]] absl::StatusOr<DrawnFrame> Draw(const DrawContext& context) const override;
};

}  // namespace halflight
