// Renders frames on one GL context: start reading here.
#pragma once

#include <cstddef>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "renderer/frame.h"
#include "renderer/frame_engine.h"
#include "renderer/gl/egl_context.h"
#include "renderer/gpu.h"

namespace halflight {

class FrameRenderer {
 public:
  // Makes a context on the device (see RenderThreadOptions) and on this thread, which must make all
  // further calls. Errors as EglContext::Create.
  static absl::StatusOr<std::unique_ptr<FrameRenderer>> Create(const std::string& device);

  // Errors: InvalidArgument where the technique cannot do what is asked, Cancelled soon after
  // `stop` was requested, ResourceExhausted when the device is out of memory, Internal for a fault
  // of GL or of a shader. The renderer stays usable after each of them.
  absl::StatusOr<FrameResult> Render(const FrameRequest& request, const std::stop_token& stop);

  [[nodiscard]] const DeviceInfo& device() const { return context_->device(); }
  // How many programs frames have needed so far.
  [[nodiscard]] size_t programs_built() const { return gpu_.programs.size(); }

 private:
  explicit FrameRenderer(std::unique_ptr<gl::EglContext> context) : context_(std::move(context)) {}

  std::unique_ptr<gl::EglContext> context_;
  Gpu gpu_;  // after context_, which it needs from its first to its last moment
};

}  // namespace halflight
