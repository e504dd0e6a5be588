// How far a frame is from the image model, from the model's values at a few hundred random pixels.
// No GL. The model has no scattering: of a scene that has it, hand in the frame without, and say
// that this is what was compared. The error at every pixel is error_map.h's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "absl/status/statusor.h"
#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight {

namespace reference {
class IndexCache;
}  // namespace reference

// Errors are of the pixels that the frame covers by more than this.
inline constexpr double kCovered = 0.01;

struct ErrorEstimateOptions {
  // Pixels at which the model is evaluated: at least 32, taken as even. With the default intervals
  // were found to hold 93 to 97 % of the time (tests/reference/error_estimate_test.cpp). With fewer
  // they hold less often where errors are few and large: with 512 about 90 % of the time for frames
  // within 2 % of the model.
  int samples = 1024;
  uint64_t seed = 1;  // the same seed takes the same pixels of the same frame
};

// A figure, and the interval that contains the truth 95 % of the time.
struct EstimatedFigure {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};

struct PixelError {
  glm::ivec2 pixel{0};    // in the image
  glm::dvec3 error{0.0};  // R, G and B of frame minus reference
  double largest = 0.0;   // of their absolute values
};

// Over R, G and B, premultiplied and linear, of the covered pixels; all zero where there are none.
// Where all of them are sampled nothing is left to chance: the figures are those of the image, and
// their intervals have no width. A frame that is not finite has errors that are not finite.
struct ErrorEstimate {
  size_t covered_pixels = 0;
  size_t sampled_pixels = 0;          // all of the covered ones where these are few
  EstimatedFigure mean_square_error;  // unbiased, as is the next
  EstimatedFigure bias;               // mean of frame minus reference
  EstimatedFigure rmse;
  // To the mean of the reference over the same pixels: infinite where that is 0 and the RMSE is
  // not.
  EstimatedFigure relative_rmse;
  double reference_mean = 0.0;  // an estimate too, and unbiased
  // Of the sample alone, not of the image: the 99.9th percentile and the largest of the absolute
  // errors of a channel, and the pixels where they are largest, worst first.
  double sample_p999 = 0.0;
  double sample_max = 0.0;
  std::vector<PixelError> sample_worst;  // kWorstPixels of them, or fewer where the sample is small
  double milliseconds = 0.0;
};
inline constexpr size_t kWorstPixels = 8;

// R G B A of the model at pixels of the image, one for each.
using ReferenceAt =
    std::function<absl::StatusOr<std::vector<glm::dvec4>>(std::span<const glm::ivec2> pixels)>;

// `beauty` is R G B A, premultiplied. InvalidArgument for options out of range, else the errors of
// `reference`.
absl::StatusOr<ErrorEstimate> EstimateError(const Image& beauty, const ReferenceAt& reference,
                                            const ErrorEstimateOptions& options = {});

// Against the scene's own model, evaluated on all cores, from what `kept` holds of the scene's
// particles where there is one; `beauty` is the scene's camera window. Cancelled soon after `stop`
// was requested.
absl::StatusOr<ErrorEstimate> EstimateError(const Image& beauty, const Scene& scene,
                                            const ErrorEstimateOptions& options = {},
                                            const std::stop_token& stop = {},
                                            reference::IndexCache* kept = nullptr);

}  // namespace halflight
