// A renderer in place of one whose device was reset.
#pragma once

#include <chrono>
#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"
#include "renderer/frame_renderer.h"
#include "renderer/render_thread.h"

namespace halflight {

// Starts the same device again, several times within a few seconds where it must: one that was
// reset may take a while to be there. The renderer before is gone. `wait` waits for so long and
// returns whether to go on. Unavailable where the device cannot be had: on another one frames would
// change, and say that they came from this. The thread that will render.
absl::StatusOr<std::unique_ptr<FrameRenderer>> StartDeviceAnew(
    const RenderThreadOptions& options, const DeviceInfo& before,
    const std::function<bool(std::chrono::milliseconds)>& wait);

}  // namespace halflight
