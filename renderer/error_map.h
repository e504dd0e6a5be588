// A frame minus the image model at every pixel, and what that comes to. No GL. Costs a whole frame
// of the reference: error_estimate.h tells nearly as much from a few pixels.
#pragma once

#include <stop_token>

#include "absl/status/statusor.h"
#include "renderer/error_estimate.h"
#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight {

// R G B of `beauty`, which is R G B A, premultiplied, and the scene's camera window. As for
// EstimateError, of a scene that scatters hand in the frame without, and `kept` saves work.
// Cancelled soon after `stop` was requested. Any thread; uses all cores.
absl::StatusOr<Image> ErrorMap(const Image& beauty, const Scene& scene,
                               const std::stop_token& stop = {},
                               reference::IndexCache* kept = nullptr);

// The figures of all covered pixels, as EstimateError gives them when it samples all, from the map
// of the same frame. `milliseconds` is left at 0.
ErrorEstimate ErrorOf(const Image& beauty, const Image& error_map);

}  // namespace halflight
