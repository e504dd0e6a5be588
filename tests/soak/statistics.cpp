#include "tests/soak/statistics.h"

#include <algorithm>
#include <cmath>

#include "tests/measure/timing.h"

namespace halflight::soak {

Slope SlopeOf(const std::vector<Point>& points) {
  std::vector<double> slopes;
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t k = i + 1; k < points.size(); ++k) {
      slopes.push_back((points[k].y - points[i].y) / (points[k].x - points[i].x));
    }
  }
  std::sort(slopes.begin(), slopes.end());
  // Kendall's sum has this deviation; the interval leaves so many slopes out on each side.
  const auto n = static_cast<double>(points.size());
  const double deviation = std::sqrt(n * (n - 1.0) * (2.0 * n + 5.0) / 18.0);
  const auto count = static_cast<double>(slopes.size());
  const double outside = std::max(0.0, (count - 1.96 * deviation) / 2.0);
  const auto first = static_cast<size_t>(outside);
  return {.value = measure::Median(slopes),
          .low = slopes[first],
          .high = slopes[slopes.size() - 1 - first]};
}

}  // namespace halflight::soak
