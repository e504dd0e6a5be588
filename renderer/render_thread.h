// The renderer behind one thread that owns the GL context, fed through a bounded queue.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"
#include "renderer/frame_renderer.h"

namespace halflight {

struct RenderThreadOptions {
  // "auto": a GPU if there is one, else the software renderer; "software"; or one of the GPUs as
  // "uuid:<32 hex digits>", "cuda:<index>", "drm:<path of its node>".
  std::string device = "auto";
  int max_queued_frames = 64;  // waiting or rendering
  FrameRendererOptions renderer;
  // Whether to build what most frames need (warm_up.h) as soon as the engine has started. A frame
  // that comes meanwhile is rendered before the rest of it.
  bool warm_up = false;
};

// Creates the context before it returns, and another when the device was reset: frames that were in
// flight end with that error, those that wait go on. InvalidArgument for a device that cannot be
// parsed, NotFound for a named one that cannot be had, Unavailable where there is none at all. The
// engine's destructor finishes what was accepted, then stops the thread.
absl::StatusOr<std::unique_ptr<FrameEngine>> StartRenderThread(const RenderThreadOptions& options);

}  // namespace halflight
