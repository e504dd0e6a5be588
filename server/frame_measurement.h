// What the pipeline does between rendering and encoding where a frame's error is asked for: the
// frame that is compared, and the comparison. Knows no threads and no clients.
#pragma once

#include <optional>
#include <stop_token>

#include "absl/status/statusor.h"
#include "renderer/error_estimate.h"
#include "renderer/frame.h"
#include "renderer/image.h"
#include "server/convert/convert_measurement.h"

namespace halflight {

// What is rendered to be compared in place of a frame whose light scatters: its beauty alone,
// without scattering.
FrameRequest WithoutScattering(const FrameRequest& request);

struct FrameError {
  ErrorEstimate estimate;
  std::optional<Image> map;  // R G B at every pixel, where the job asks for it
};

// Of `beauty`, R G B A, against the scene's image model. A job with a map has the model at every
// pixel, so the estimate is of all of them. Cancelled soon after `stop` was requested. Any thread;
// uses all cores.
absl::StatusOr<FrameError> MeasureFrame(const Image& beauty, const Scene& scene,
                                        const MeasureJob& job, const std::stop_token& stop);

}  // namespace halflight
