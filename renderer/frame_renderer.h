// Renders frames on one GL context: start reading here.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "renderer/frame.h"
#include "renderer/frame_cache.h"
#include "renderer/frame_engine.h"
#include "renderer/gl/egl_context.h"
#include "renderer/gpu.h"

namespace halflight {

struct FrameRendererOptions {
  // Of what frames leave to those that follow, in main memory and on the device together; 0:
  // nothing is reused.
  size_t max_reuse_bytes = size_t{1} << 30U;
  // Largest side of a render target or a light buffer, where it is less than the device's; at
  // least 16.
  int max_texture_size = std::numeric_limits<int>::max();
};

class FrameRenderer {
 public:
  // Makes a context on the device (see RenderThreadOptions) and on this thread, which must make all
  // further calls. Errors as EglContext::Create.
  static absl::StatusOr<std::unique_ptr<FrameRenderer>> Create(
      const std::string& device, const FrameRendererOptions& options = {});

  // Errors: InvalidArgument where the technique cannot do what is asked, Cancelled soon after
  // `stop` was requested, ResourceExhausted when the device is out of memory, Internal for a fault
  // of GL or of a shader. The renderer stays usable after each of them. A frame has the same images
  // whatever was rendered before it; a particle set must not change once it has been rendered.
  absl::StatusOr<FrameResult> Render(const FrameRequest& request, const std::stop_token& stop);

  [[nodiscard]] const DeviceInfo& device() const { return device_; }
  [[nodiscard]] const FrameCache& cache() const { return cache_; }
  // How many programs frames have needed so far.
  [[nodiscard]] size_t programs_built() const { return gpu_.programs.size(); }

 private:
  FrameRenderer(std::unique_ptr<gl::EglContext> context, const FrameRendererOptions& options);

  std::unique_ptr<gl::EglContext> context_;
  DeviceInfo device_;
  // After context_, which these need from their first to their last moment.
  Gpu gpu_;
  FrameCache cache_;
};

}  // namespace halflight
