#include "renderer/error_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "renderer/reference/evaluator.h"

namespace halflight {

namespace {

// So many at a time: enough for all cores, few beside the image itself.
constexpr int kPixelsAtATime = 65536;

// Keeps the worst pixels of all that it is shown, worst first.
class WorstPixels {
 public:
  void Add(const PixelError& error) {
    if (worst_.size() == kWorstPixels && error.largest <= worst_.back().largest) return;
    if (worst_.size() == kWorstPixels) worst_.pop_back();
    const auto place = std::upper_bound(
        worst_.begin(), worst_.end(), error,
        [](const PixelError& a, const PixelError& b) { return a.largest > b.largest; });
    worst_.insert(place, error);
  }
  [[nodiscard]] std::vector<PixelError> Take() { return std::move(worst_); }

 private:
  std::vector<PixelError> worst_;
};

// Of an image so wide, row by row.
std::vector<glm::ivec2> PixelsOfRows(int width, int top, int bottom) {
  std::vector<glm::ivec2> pixels;
  for (int y = top; y < bottom; ++y) {
    for (int x = 0; x < width; ++x) pixels.emplace_back(x, y);
  }
  return pixels;
}

EstimatedFigure Certain(double value) { return {value, value, value}; }

}  // namespace

absl::StatusOr<Image> ErrorMap(const Image& beauty, const Scene& scene, const std::stop_token& stop,
                               reference::IndexCache* kept) {
  const auto evaluator = reference::Evaluator::Create(scene, stop, kept);
  if (!evaluator.ok()) return evaluator.status();
  reference::EvaluateOptions options;
  options.stop = stop;
  Image map{beauty.width, beauty.height, 1, {"R", "G", "B"}, {}};
  map.pixels.reserve(beauty.pixels.size() / 4 * 3);
  const int rows_at_a_time = std::max(1, kPixelsAtATime / beauty.width);
  for (int top = 0; top < beauty.height; top += rows_at_a_time) {
    const int bottom = std::min(top + rows_at_a_time, beauty.height);
    const absl::StatusOr<reference::PixelValues> exact =
        (*evaluator)->Evaluate(PixelsOfRows(beauty.width, top, bottom), options);
    if (!exact.ok()) return exact.status();
    for (const glm::dvec4& expected : exact->rgba) {
      const float* rgba = &beauty.pixels[map.pixels.size() / 3 * 4];
      for (int channel = 0; channel < 3; ++channel) {
        map.pixels.push_back(
            static_cast<float>(static_cast<double>(rgba[channel]) - expected[channel]));
      }
    }
  }
  return map;
}

ErrorEstimate ErrorOf(const Image& beauty, const Image& error_map) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  ErrorEstimate result;
  double squares = 0.0;
  double differences = 0.0;
  double reference = 0.0;
  std::vector<float> absolute;
  WorstPixels worst;
  const auto width = static_cast<size_t>(beauty.width);
  for (size_t i = 0; i < error_map.pixels.size() / 3; ++i) {
    const std::span<const float, 4> rgba(&beauty.pixels[4 * i], 4);
    if (!(static_cast<double>(rgba[3]) > kCovered)) continue;
    ++result.covered_pixels;
    PixelError error{glm::ivec2(i % width, i / width), glm::dvec3(0.0), 0.0};
    for (int channel = 0; channel < 3; ++channel) {
      const float value = error_map.pixels[3 * i + static_cast<size_t>(channel)];
      error.error[channel] = value;
      squares += error.error[channel] * error.error[channel];
      differences += error.error[channel];
      reference += static_cast<double>(rgba[static_cast<size_t>(channel)]) - error.error[channel];
      absolute.push_back(std::isnan(value) ? kInfinity : std::abs(value));
      error.largest = std::max(error.largest, static_cast<double>(absolute.back()));
    }
    worst.Add(error);
  }
  if (absolute.empty()) return result;
  result.sampled_pixels = result.covered_pixels;
  const auto count = static_cast<double>(absolute.size());
  result.mean_square_error = Certain(squares / count);
  result.bias = Certain(differences / count);
  result.rmse = Certain(std::sqrt(squares / count));
  result.reference_mean = reference / count;
  if (squares != 0.0) {
    result.relative_rmse =
        Certain(result.reference_mean == 0.0 ? std::numeric_limits<double>::infinity()
                                             : result.rmse.value / result.reference_mean);
  }
  const auto p999 = absolute.begin() +
                    static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(absolute.size() - 1));
  std::nth_element(absolute.begin(), p999, absolute.end());
  result.sample_p999 = *p999;
  result.sample_max = *std::max_element(p999, absolute.end());
  result.sample_worst = worst.Take();
  return result;
}

}  // namespace halflight
