#include "renderer/techniques/light_sweep.h"

#include "renderer/frame_engine.h"
#include "renderer/sweep/cpu_frame.h"
#include "renderer/sweep/device/frame.h"

namespace halflight {

namespace {

constexpr char kName[] = "LIGHT_SWEEP";

// The device sweeps every light in one go: what happens between slabs is the CPU's.
bool IsCutIntoSlabs(const FrameRequest& request) {
  return request.scene.scatters() || Shows(request, ImageKind::kLightLayers);
}

}  // namespace

absl::Status LightSweep::Check(const FrameRequest& request) const {
  if (request.sweep_on == SweepOn::kDevice) {
    if (Shows(request, ImageKind::kLightLayers)) {
      return Refuse("outputs", "light layers", "LIGHT_SWEEP on the device",
                    "beauty, coverage, depth, light transmittance, light buffer");
    }
    if (absl::Status status = CheckNoScattering(request.scene, "LIGHT_SWEEP on the device",
                                                "it has no slices to blur between");
        !status.ok()) {
      return status;
    }
  }
  return sweep::CheckSizes(request, kName);
}

absl::Status LightSweep::Plan(const FrameRequest& request, const ParticleView& particles,
                              FramePlan& plan) const {
  return sweep::PlanFrame(request, particles, kName, plan);
}

bool LightSweep::DrawsOnDevice(const FrameRequest& request, const DeviceInfo& device) const {
  const SweepOn where = request.sweep_on;
  return where == SweepOn::kDevice ||
         (where == SweepOn::kAuto && !device.software && !IsCutIntoSlabs(request));
}

absl::StatusOr<DrawnFrame> LightSweep::Draw(const DrawContext& context) const {
  if (!DrawsOnDevice(context.request, context.device)) return sweep::DrawOnCpu(context);
  absl::StatusOr<DrawnFrame> frame = sweep::DrawOnDevice(context);
  // What the device cannot hold the CPU can, unless the device was asked for.
  const bool too_large = absl::IsResourceExhausted(frame.status());
  if (too_large && context.request.sweep_on == SweepOn::kAuto) return sweep::DrawOnCpu(context);
  return frame;
}

}  // namespace halflight
