// The one thread that owns the GL context, fed through a bounded queue.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"

namespace halflight {

struct RenderThreadOptions {
  // "auto": a GPU if there is one, else the software renderer; "software"; or one of the GPUs as
  // "uuid:<32 hex digits>", "cuda:<index>", "drm:<path of its node>".
  std::string device = "auto";
  int max_queued_frames = 64;  // waiting or rendering
};

class RenderThread : public FrameEngine {
 public:
  // Creates the context and compiles all programs before it returns. InvalidArgument for a device
  // that cannot be parsed, NotFound or Internal where it cannot be had.
  static absl::StatusOr<std::unique_ptr<RenderThread>> Start(const RenderThreadOptions& options);

  // Finishes what was accepted, then stops the thread.
  ~RenderThread() override = default;
};

}  // namespace halflight
