// The narrow interface through which a service sees the renderer, so that it is tested without GL.
#pragma once

#include <functional>
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
};

}  // namespace halflight
