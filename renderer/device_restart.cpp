#include "renderer/device_restart.h"

#include "absl/strings/str_cat.h"
#include "renderer/device_fault.h"

namespace halflight {

namespace {

// Each wait is twice the one before.
constexpr std::chrono::milliseconds kFirstWait(100);
constexpr int kAttempts = 6;

absl::StatusOr<std::unique_ptr<FrameRenderer>> Start(const RenderThreadOptions& options,
                                                     const DeviceInfo& before) {
  if (options.renderer.faults != nullptr && options.renderer.faults->gone()) {
    return absl::UnavailableError("planned");
  }
  auto renderer = FrameRenderer::Create(options.device, options.renderer);
  if (renderer.ok() && (*renderer)->device().gl_renderer != before.gl_renderer) {
    return absl::UnavailableError(
        absl::StrCat("only ", (*renderer)->device().gl_renderer, " is left"));
  }
  return renderer;
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameRenderer>> StartDeviceAnew(
    const RenderThreadOptions& options, const DeviceInfo& before,
    const std::function<bool(std::chrono::milliseconds)>& wait) {
  auto renderer = Start(options, before);
  auto next = kFirstWait;
  for (int attempt = 1; attempt < kAttempts && !renderer.ok() && wait(next); ++attempt) {
    next *= 2;
    renderer = Start(options, before);
  }
  if (!renderer.ok()) return DeviceGoneError(renderer.status());
  return renderer;
}

}  // namespace halflight
