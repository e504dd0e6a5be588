// Statistics over differences; see image_error.h.
#include "tests/oracle/image_error.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

namespace halflight::oracle {
namespace {

constexpr double kCovered = 0.01;

// Collects pairs of values, then sums them up.
class Statistics {
 public:
  void Add(double value, double reference, bool covered) {
    const double difference = value - reference;
    differences_.push_back(std::abs(difference));
    sum_ += difference;
    squares_ += difference * difference;
    if (!covered) return;
    ++covered_;
    covered_squares_ += difference * difference;
    covered_reference_ += reference;
  }

  [[nodiscard]] ImageError Finish(size_t pixels) {
    ImageError error;
    error.pixels = pixels;
    if (differences_.empty()) return error;
    const auto count = static_cast<double>(differences_.size());
    error.rmse = std::sqrt(squares_ / count);
    error.bias = sum_ / count;
    std::sort(differences_.begin(), differences_.end());
    error.max = differences_.back();
    error.p999 = differences_[static_cast<size_t>(0.999 * (count - 1.0))];
    if (covered_ > 0 && covered_reference_ > 0.0) {
      const auto covered = static_cast<double>(covered_);
      error.relative_rmse = std::sqrt(covered_squares_ / covered) / (covered_reference_ / covered);
    }
    return error;
  }

 private:
  std::vector<double> differences_;
  double sum_ = 0.0;
  double squares_ = 0.0;
  size_t covered_ = 0;
  double covered_squares_ = 0.0;
  double covered_reference_ = 0.0;
};

double ValueAt(const Image& image, const glm::ivec2& pixel, size_t channel) {
  const size_t index = static_cast<size_t>(pixel.y) * static_cast<size_t>(image.width) +
                       static_cast<size_t>(pixel.x);
  return image.pixels[index * image.channels.size() + channel];
}

}  // namespace

std::string ImageError::ToString() const {
  std::ostringstream text;
  text << "rmse " << rmse << ", bias " << bias << ", max " << max << ", p99.9 " << p999
       << ", relative rmse " << relative_rmse << " over " << pixels << " pixels";
  return text.str();
}

ImageError CompareColor(const Image& image, const OracleImage& reference) {
  Statistics statistics;
  for (size_t i = 0; i < reference.pixels.size(); ++i) {
    const glm::dvec4& expected = reference.rgba[i];
    for (int channel = 0; channel < 3; ++channel) {
      statistics.Add(ValueAt(image, reference.pixels[i], static_cast<size_t>(channel)),
                     expected[channel], expected.a > kCovered);
    }
  }
  return statistics.Finish(reference.pixels.size());
}

ImageError CompareCoverage(const Image& image, const OracleImage& reference) {
  const auto alpha = std::find(image.channels.begin(), image.channels.end(), "A");
  const auto channel = static_cast<size_t>(alpha - image.channels.begin());
  Statistics statistics;
  for (size_t i = 0; i < reference.pixels.size(); ++i) {
    const double expected = reference.rgba[i].a;
    statistics.Add(ValueAt(image, reference.pixels[i], channel), expected, expected > kCovered);
  }
  return statistics.Finish(reference.pixels.size());
}

ImageError CompareColor(const OracleImage& image, const OracleImage& reference) {
  Statistics statistics;
  for (size_t i = 0; i < reference.pixels.size(); ++i) {
    const glm::dvec4& expected = reference.rgba[i];
    for (int channel = 0; channel < 3; ++channel) {
      statistics.Add(image.rgba[i][channel], expected[channel], expected.a > kCovered);
    }
  }
  return statistics.Finish(reference.pixels.size());
}

}  // namespace halflight::oracle
