// What the pipeline does between rendering and encoding where a frame's error is asked for: the
// frame that is compared, and the comparison. Knows no threads and no clients.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <stop_token>

#include "absl/status/statusor.h"
#include "renderer/error_estimate.h"
#include "renderer/frame.h"
#include "renderer/image.h"
#include "renderer/reference/index_cache.h"
#include "server/convert/convert_measurement.h"

namespace halflight {

// What is rendered to be compared in place of a frame whose light scatters: its beauty alone,
// without scattering.
FrameRequest WithoutScattering(const FrameRequest& request);

struct FrameError {
  ErrorEstimate estimate;
  std::optional<Image> map;  // R G B at every pixel, where the job asks for it
};

// What a measurer keeps of the reference's indexes at most. With 65,536 particles the eye's takes
// 6 MB, and that of a light 60 MB.
inline constexpr size_t kMaxIndexBytes = size_t{256} << 20U;

// Holds frames against the image model, and keeps what it has worked out of their particles for the
// next frame of the same set: see renderer/reference/index_cache.h. Copies share what is kept. Any
// thread.
class FrameMeasurer {
 public:
  explicit FrameMeasurer(size_t max_index_bytes = kMaxIndexBytes)
      : indexes_(std::make_shared<reference::IndexCache>(max_index_bytes)) {}

  // Of `beauty`, R G B A, against the scene's image model. A job with a map has the model at every
  // pixel, so the estimate is of all of them. Cancelled soon after `stop` was requested. Uses all
  // cores.
  absl::StatusOr<FrameError> operator()(const Image& beauty, const Scene& scene,
                                        const MeasureJob& job, const std::stop_token& stop) const;

 private:
  std::shared_ptr<reference::IndexCache> indexes_;
};

}  // namespace halflight
