#include "tests/measure/frame_error.h"

#include <utility>

#include "renderer/error_estimate.h"
#include "tests/oracle/image_error.h"

namespace halflight::measure {

CoveredReference EvaluateCovered(const Scene& scene) {
  constexpr double kCovered = 0.01;
  const oracle::OracleImage exact = oracle::RenderExact(scene, {.threads = 0});
  CoveredReference covered;
  covered.pixels.width = exact.width;
  covered.pixels.height = exact.height;
  for (size_t i = 0; i < exact.pixels.size(); ++i) {
    const glm::dvec4& rgba = exact.rgba[i];
    if (!(rgba.a > kCovered)) continue;
    covered.pixels.pixels.push_back(exact.pixels[i]);
    covered.pixels.rgba.push_back(rgba);
    covered.mean += (rgba.r + rgba.g + rgba.b) / 3.0;
  }
  covered.mean /= static_cast<double>(covered.pixels.pixels.size());
  return covered;
}

FrameError CompareAll(const Image& beauty, const CoveredReference& reference) {
  const oracle::ImageError error = oracle::CompareColor(beauty, reference.pixels);
  return {.rmse = error.relative_rmse,
          .rmse_low = error.relative_rmse,
          .rmse_high = error.relative_rmse,
          .bias = error.bias / reference.mean,
          .p999 = error.p999 / reference.mean,
          .max = error.max / reference.mean};
}

absl::StatusOr<FrameError> CompareSample(const Image& beauty,
                                         const reference::Evaluator& evaluator) {
  const ReferenceAt reference =
      [&](std::span<const glm::ivec2> pixels) -> absl::StatusOr<std::vector<glm::dvec4>> {
    absl::StatusOr<reference::PixelValues> values = evaluator.Evaluate(pixels);
    if (!values.ok()) return values.status();
    return std::move(values->rgba);
  };
  const absl::StatusOr<ErrorEstimate> estimate = EstimateError(beauty, reference);
  if (!estimate.ok()) return estimate.status();
  return FrameError{.rmse = estimate->relative_rmse.value,
                    .rmse_low = estimate->relative_rmse.low,
                    .rmse_high = estimate->relative_rmse.high,
                    .bias = estimate->bias.value / estimate->reference_mean,
                    .p999 = estimate->sample_p999 / estimate->reference_mean,
                    .max = estimate->sample_max / estimate->reference_mean};
}

}  // namespace halflight::measure
