// Figures of many: times of calls, and how something grows.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace halflight::soak {

// A line through points, by Theil and Sen: the median of the slopes of all pairs, which single
// outliers do not move; low and high hold the true slope 95 % of the time (Kendall's statistic,
// after Sen 1968) where errors are independent.
struct Slope {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};

struct Point {
  double x = 0.0;
  double y = 0.0;
};

// Of three points or more.
Slope SlopeOf(const std::vector<Point>& points);

}  // namespace halflight::soak
