// Renders frames on one GL context: start reading here.
#pragma once

#include <chrono>
#include <cstddef>
#include <limits>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/device_fault.h"
#include "renderer/frame.h"
#include "renderer/frame_cache.h"
#include "renderer/frame_engine.h"
#include "renderer/gl/egl_context.h"
#include "renderer/gl/staging.h"
#include "renderer/gpu.h"
#include "renderer/raster_pieces.h"
#include "renderer/shadow_technique.h"
#include "renderer/stage_clock.h"

namespace halflight {

struct FrameRendererOptions {
  // Of what frames leave to those that follow, in main memory and on the device together; 0:
  // nothing is reused.
  size_t max_reuse_bytes = size_t{1} << 30U;
  // Largest side of a render target or a light buffer, where it is less than the device's; at
  // least 64.
  int max_texture_size = std::numeric_limits<int>::max();
  // Of which one is read back while the device draws the others; one: every frame is read back as
  // soon as it is drawn. 0: two on GPUs, one on CPU rasterisers, which draw when told to.
  int frames_in_flight = 0;
  std::shared_ptr<PlannedFaults> faults{};  // of tests; null: none
};

class FrameRenderer {
 public:
  // A frame between its halves: what it was drawn from, and what is on its way.
  struct Begun {
    FrameRequest request;
    std::stop_token stop;
    StageClock clock;
    FramePlan plan;
    DrawnFrame drawn;
    size_t clamped_opacities = 0;
    // Until then the device is at it, by plan.
    std::chrono::steady_clock::time_point late_until;
  };

  // Makes a context on the device (see RenderThreadOptions) and on this thread, which must make all
  // further calls. Errors as EglContext::Create.
  static absl::StatusOr<std::unique_ptr<FrameRenderer>> Create(
      const std::string& device, const FrameRendererOptions& options = {});

  // Both halves of a frame. Errors: InvalidArgument where the technique cannot do what is asked,
  // Cancelled soon after `stop` was requested, ResourceExhausted when the device is out of memory,
  // Internal for a fault of GL or of a shader. The renderer stays usable after each of them; only
  // after one of device_fault.h it is lost. A frame has the same images whatever was rendered
  // before it; a particle set must not change once it has been rendered.
  absl::StatusOr<FrameResult> Render(const FrameRequest& request, const std::stop_token& stop);

  // The first half: plans the frame, uploads what it needs, and records what the device shall do
  // and copy; work of the CPU is done when it returns. Others may be begun and finished before this
  // one is finished, in any order, and what becomes of them is nothing to it. Whatever it returned
  // must be gone before the renderer is.
  absl::StatusOr<std::unique_ptr<Begun>> Begin(FrameRequest request, std::stop_token stop);
  // Whether the second half need not wait for the device, or only finds that it was cancelled.
  // Waits for that itself, at most for so long.
  [[nodiscard]] bool CanFinish(const Begun& frame, std::chrono::nanoseconds wait) const;
  // Whether the device has come to the frame's end, or to its own; waits at most for so long. One
  // that was cancelled may still be drawn.
  [[nodiscard]] static bool IsDrawn(const Begun& frame, std::chrono::nanoseconds wait);
  // The second half: waits for the device where it must, and takes over what it has copied.
  absl::StatusOr<FrameResult> Finish(std::unique_ptr<Begun> frame);

  // OK, or that the device was reset: the renderer is of no use any more.
  absl::Status CheckReset();

  // As many frames as are worth having begun at once.
  [[nodiscard]] size_t frames_in_flight() const { return frames_in_flight_; }
  // Whether the device draws the frame, so that beginning it is only a matter of recording.
  [[nodiscard]] bool DrawsOnDevice(const FrameRequest& request) const;

  [[nodiscard]] const DeviceInfo& device() const { return device_; }
  [[nodiscard]] const FrameCache& cache() const { return cache_; }
  // How many programs frames have needed so far.
  [[nodiscard]] size_t programs_built() const { return gpu_.programs.size(); }
  [[nodiscard]] const RasterPieces& raster_pieces() const { return pieces_; }

 private:
  FrameRenderer(std::unique_ptr<gl::EglContext> context, const FrameRendererOptions& options);

  // Begins `frame`, of which request and stop are set.
  absl::Status Record(Begun& frame);
  // Draws `frame`, unless a fault is planned.
  absl::StatusOr<DrawnFrame> Draw(const ShadowTechnique& technique, const DrawContext& context,
                                  Begun& frame);

  std::unique_ptr<gl::EglContext> context_;
  DeviceInfo device_;
  // After context_, which these need from their first to their last moment.
  Gpu gpu_;
  FrameCache cache_;
  gl::StagingMemory staging_;
  RasterPieces pieces_;
  size_t frames_in_flight_;
  std::shared_ptr<PlannedFaults> faults_;
  absl::Status reset_;
};

}  // namespace halflight
