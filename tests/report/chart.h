// Charts with logarithmic axes: frame, ticks, points, and labels that keep clear of one another.
// Knows nothing of what is drawn; see plots.h.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tests/report/svg.h"

namespace halflight::report {

struct Box {
  double x;
  double y;
  double width;
  double height;
};

bool Overlaps(const Box& a, const Box& b);

// Values from low to high, both > 0.
struct LogRange {
  double low;
  double high;
};

// Wide enough for all values > 0, and a little more at both ends; at least a factor of four.
LogRange RangeAround(const std::vector<double>& values);

// 1, 2, 5 and their decades within the range; only decades where it spans more than four of them.
std::vector<double> Ticks(const LogRange& range);

struct Axis {
  LogRange range;
  std::string title;
  std::string (*format)(double value);
};

class Chart {
 public:
  // Draws frame, grid and titles within `outer`; the title of the whole above the frame.
  Chart(Svg& svg, const Box& outer, std::string_view title, Axis x, Axis y);

  // Where a pair of values lies. Values beyond the axes lie on the frame.
  [[nodiscard]] Point At(double x, double y) const;

  // Labels keep away from it where they can.
  void Curve(const std::vector<Point>& points, std::string_view color, double width);
  // Labels keep away from it.
  void Mark(Marker marker, Point at, std::string_view color, bool hollow);
  // Beside the point, where it covers neither marks nor other labels, and curves only where there
  // is no better place; where there is none at all, nothing. Call after all marks and curves.
  void Label(Point beside, std::string_view text, const TextStyle& style);

 private:
  Svg& svg_;
  Box frame_;
  Axis x_;
  Axis y_;
  std::vector<Box> taken_;   // by marks and labels
  std::vector<Box> curves_;  // small boxes along them
};

}  // namespace halflight::report
