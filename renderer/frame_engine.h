// The narrow interface through which a service sees the renderer, so that it is tested without GL.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/frame.h"

namespace halflight {

struct DeviceInfo {
  std::string gl_renderer;
  std::string gl_version;
  int max_texture_size = 0;
  bool software = false;         // a CPU rasteriser
  bool tells_of_resets = false;  // rather than going on with anything (KHR_robustness)
};

// How an engine is doing at the moment.
struct EngineState {
  uint64_t gl_objects = 0;  // buffers and textures
  uint64_t gl_bytes = 0;    // that they take on the device
  uint64_t device_resets = 0;
  // Why no frame can be rendered any more: the device was lost and cannot be had again.
  absl::Status end;
  // Since when it should have come back: from the longest of the frames that were told to stop and
  // have not, or from starting the device anew. A device that hangs never does.
  std::optional<std::chrono::steady_clock::time_point> overdue_since{};
};

class FrameEngine {
 public:
  using Done = std::function<void(absl::StatusOr<FrameResult>)>;

  virtual ~FrameEngine() = default;

  // Queues a frame. Its timings begin with "queue", the time until it was begun. When it returns
  // OK, `done` is called exactly once, on the engine's thread, in the order of submission: with the
  // frame, or with an error; with Cancelled soon after `stop` was requested, then before others
  // where it still waits; with an error of device_fault.h when the device failed under it, which is
  // then started anew. Otherwise `done` is never called: ResourceExhausted when the queue is full,
  // Unavailable when the engine is shutting down or has come to its end. Any thread.
  virtual absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) = 0;

  // The same at all times. Any thread.
  [[nodiscard]] virtual const DeviceInfo& device() const = 0;

  // How many frames it draws at once: with more it can only let them wait. The same at all times.
  [[nodiscard]] virtual int frames_in_flight() const { return 1; }

  // Any thread.
  [[nodiscard]] virtual EngineState state() const { return {}; }
};

}  // namespace halflight
