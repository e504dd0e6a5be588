#include "renderer/error_estimate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "renderer/reference/evaluator.h"
#include "renderer/stratified_sample.h"

namespace halflight {

namespace {

constexpr int kLeastSamples = 32;

struct CoveredPixels {
  std::vector<glm::ivec2> places;
  std::vector<glm::dvec3> colors;
  std::vector<double> expected_error;  // in any unit
};

// What is no number is as wrong as can be, and has to have a place in an order.
double SizeOf(double error) {
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : std::abs(error);
}

double MeanOf(const glm::dvec3& color) { return (color.x + color.y + color.z) / 3.0; }

// Errors of shadows grow with the light that a pixel shows and with the smoke that it shows it of.
// Every pixel keeps some expected error: it might be dark in error.
CoveredPixels FindCovered(const Image& beauty) {
  constexpr double kLeastExpected = 0.1;  // of the mean
  CoveredPixels covered;
  double sum = 0.0;
  for (int y = 0; y < beauty.height; ++y) {
    for (int x = 0; x < beauty.width; ++x) {
      const float* rgba =
          &beauty.pixels[4 * (static_cast<size_t>(y) * static_cast<size_t>(beauty.width) +
                              static_cast<size_t>(x))];
      if (!(rgba[3] > kCovered)) continue;
      covered.places.emplace_back(x, y);
      covered.colors.emplace_back(rgba[0], rgba[1], rgba[2]);
      const double expected =
          std::sqrt(std::max(0.0, MeanOf(covered.colors.back())) * static_cast<double>(rgba[3]));
      covered.expected_error.push_back(std::isfinite(expected) ? expected : 0.0);
      sum += covered.expected_error.back();
    }
  }
  const double mean = sum / static_cast<double>(covered.places.size());
  for (double& expected : covered.expected_error) {
    expected = (mean > 0.0 ? expected / mean : 1.0) + kLeastExpected;
  }
  return covered;
}

EstimatedFigure SymmetricInterval(const MeanEstimate& estimate) {
  const double half =
      StudentQuantile975(estimate.degrees_of_freedom) * std::sqrt(estimate.variance);
  return {estimate.mean, estimate.mean - half, estimate.mean + half};
}

// Symmetric in the logarithm, since a mean of squares is never negative and errs upwards: `value`
// times exp(-+ half).
EstimatedFigure LogInterval(double value, double half) {
  return {value, value * std::exp(-half), value * std::exp(half)};
}

// Half the width of the logarithm's interval, from an estimate of the same relative error.
double LogHalf(const MeanEstimate& estimate, double scale) {
  if (!(scale > 0.0)) return 0.0;
  return StudentQuantile975(estimate.degrees_of_freedom) * std::sqrt(estimate.variance) / scale;
}

void FillMeans(std::span<const Stratum> strata, std::span<const PixelError> errors,
               std::span<const double> reference, ErrorEstimate& result) {
  const size_t count = errors.size();
  std::vector<double> squares(count);
  std::vector<double> differences(count);
  for (size_t i = 0; i < count; ++i) {
    squares[i] = MeanOf(errors[i].error * errors[i].error);
    differences[i] = MeanOf(errors[i].error);
  }
  const MeanEstimate square = EstimateMean(strata, squares);
  result.reference_mean = EstimateMean(strata, reference).mean;
  result.bias = SymmetricInterval(EstimateMean(strata, differences));
  const double half = LogHalf(square, square.mean);
  result.mean_square_error = LogInterval(square.mean, half);
  result.rmse = LogInterval(std::sqrt(square.mean), 0.5 * half);
  if (square.mean == 0.0) return;
  if (result.reference_mean == 0.0) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    result.relative_rmse = {kInfinity, kInfinity, kInfinity};
    return;
  }

  // The logarithm of the ratio, to first order, is the mean of this (Cochran 6.12).
  std::vector<double> linear(count);
  for (size_t i = 0; i < count; ++i) {
    linear[i] = 0.5 * squares[i] / square.mean - reference[i] / result.reference_mean;
  }
  result.relative_rmse = LogInterval(std::sqrt(square.mean) / result.reference_mean,
                                     LogHalf(EstimateMean(strata, linear), 1.0));
}

void FillExtremes(std::vector<PixelError> errors, ErrorEstimate& result) {
  std::vector<double> absolute;
  for (const PixelError& error : errors) {
    for (int channel = 0; channel < 3; ++channel) {
      absolute.push_back(SizeOf(error.error[channel]));
    }
  }
  std::sort(absolute.begin(), absolute.end());
  result.sample_max = absolute.back();
  result.sample_p999 =
      absolute[static_cast<size_t>(0.999 * static_cast<double>(absolute.size() - 1))];
  std::stable_sort(errors.begin(), errors.end(),
                   [](const PixelError& a, const PixelError& b) { return a.largest > b.largest; });
  errors.resize(std::min(errors.size(), kWorstPixels));
  result.sample_worst = std::move(errors);
}

}  // namespace

absl::StatusOr<ErrorEstimate> EstimateError(const Image& beauty, const ReferenceAt& reference,
                                            const ErrorEstimateOptions& options) {
  if (options.samples < kLeastSamples) {
    return absl::InvalidArgumentError(
        absl::StrCat("samples: ", options.samples, ", allowed: at least ", kLeastSamples));
  }
  const auto begin = std::chrono::steady_clock::now();
  const CoveredPixels covered = FindCovered(beauty);
  ErrorEstimate result;
  result.covered_pixels = covered.places.size();
  if (covered.places.empty()) return result;  // there is nothing to divide by

  const std::vector<Stratum> strata = DrawStrata(
      covered.expected_error, static_cast<size_t>(options.samples) / 2 * 2, options.seed);
  std::vector<glm::ivec2> pixels;
  for (const Stratum& stratum : strata) {
    for (const uint32_t drawn : stratum.drawn) pixels.push_back(covered.places[drawn]);
  }
  result.sampled_pixels = pixels.size();
  const absl::StatusOr<std::vector<glm::dvec4>> exact = reference(pixels);
  if (!exact.ok()) return exact.status();

  std::vector<PixelError> errors;
  std::vector<double> reference_means;
  for (const Stratum& stratum : strata) {
    for (const uint32_t drawn : stratum.drawn) {
      const glm::dvec3 expected((*exact)[errors.size()]);
      const glm::dvec3 error = covered.colors[drawn] - expected;
      errors.push_back({covered.places[drawn], error,
                        std::max({SizeOf(error.x), SizeOf(error.y), SizeOf(error.z)})});
      reference_means.push_back(MeanOf(expected));
    }
  }
  FillMeans(strata, errors, reference_means, result);
  FillExtremes(std::move(errors), result);
  result.milliseconds =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

absl::StatusOr<ErrorEstimate> EstimateError(const Image& beauty, const Scene& scene,
                                            const ErrorEstimateOptions& options,
                                            const std::stop_token& stop,
                                            reference::IndexCache* kept) {
  const ReferenceAt reference =
      [&](std::span<const glm::ivec2> pixels) -> absl::StatusOr<std::vector<glm::dvec4>> {
    const auto evaluator = reference::Evaluator::Create(scene, stop, kept);
    if (!evaluator.ok()) return evaluator.status();
    reference::EvaluateOptions evaluate;
    evaluate.stop = stop;
    absl::StatusOr<reference::PixelValues> values = (*evaluator)->Evaluate(pixels, evaluate);
    if (!values.ok()) return values.status();
    return std::move(values->rgba);
  };
  return EstimateError(beauty, reference, options);
}

}  // namespace halflight
