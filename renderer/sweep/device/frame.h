// Whole frames of the light sweep on the device: lists, light, shading and the eye pass without a
// step on the CPU. Plans and chooses nothing.
#pragma once

#include <cstddef>

#include "absl/status/statusor.h"
#include "renderer/shadow_technique.h"

namespace halflight::sweep {

struct DeviceFrameSettings {
  // Of a buffer that one run of the eye's order fills, at most: enough for a million particles and
  // one light at degree 6, which keep a device busy, and little beside what the particles take.
  size_t most_run_bytes = size_t{1} << 27U;
};

// What LightSweep draws on the CPU, to what float32 leaves of it. ResourceExhausted where the
// device has too little memory, or storage blocks that are too small. Cancelled soon after the
// context's stop was requested. Needs a current context.
absl::StatusOr<DrawnFrame> DrawOnDevice(const DrawContext& context,
                                        const DeviceFrameSettings& settings = {});

}  // namespace halflight::sweep
