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
  bool software = false;  // a CPU rasteriser
};

// How an engine is doing at the moment.
struct EngineState {
  uint64_t gl_objects = 0;  // buffers and textures
  uint64_t gl_bytes = 0;    // that they take on the device
  uint64_t device_resets = 0;
  // Since when its thread is at the same half of a frame; none while it waits for frames.
  std::optional<std::chrono::steady_clock::time_point> busy_since{};
};

class FrameEngine {
 public:
  using Done = std::function<void(absl::StatusOr<FrameResult>)>;

  virtual ~FrameEngine() = default;

  // Queues a frame. Its timings begin with "queue", the time until it was begun. When it returns
  // OK, `done` is called exactly once, on the engine's thread, in the order of submission: with the
  // frame, with an error, or with Cancelled soon after `stop` was requested. Otherwise `done` is
  // never called: ResourceExhausted when the queue is full, Unavailable when the engine is shutting
  // down. Any thread.
  virtual absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) = 0;

  // The same at all times. Any thread.
  [[nodiscard]] virtual const DeviceInfo& device() const = 0;

  // Any thread.
  [[nodiscard]] virtual EngineState state() const { return {}; }
};

}  // namespace halflight
