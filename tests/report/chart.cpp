#include "tests/report/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace halflight::report {
namespace {

constexpr double kTextSize = 12.0;
constexpr const char* kGridColor = "#e3e6ea";
constexpr const char* kAxisColor = "#57606a";

// Where `value` lies between the ends of the range: 0 the low one, 1 the high one.
double Fraction(const LogRange& range, double value) {
  const double clamped = std::clamp(value, range.low, range.high);
  return std::log(clamped / range.low) / std::log(range.high / range.low);
}

}  // namespace

bool Overlaps(const Box& a, const Box& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

LogRange RangeAround(const std::vector<double>& values) {
  constexpr double kMargin = 1.25;
  constexpr double kLeastSpan = 4.0;
  double low = 1.0;
  double high = 1.0;
  bool any = false;
  for (const double value : values) {
    if (!(value > 0.0)) continue;
    low = any ? std::min(low, value) : value;
    high = any ? std::max(high, value) : value;
    any = true;
  }
  low /= kMargin;
  high *= kMargin;
  const double missing = std::max(1.0, kLeastSpan / (high / low));
  return {low / std::sqrt(missing), high * std::sqrt(missing)};
}

std::vector<double> Ticks(const LogRange& range) {
  constexpr double kMostSpan = 1e4;
  std::vector<double> ticks;
  const auto first = static_cast<int>(std::floor(std::log10(range.low)));
  const auto last = static_cast<int>(std::ceil(std::log10(range.high)));
  for (int exponent = first; exponent <= last; ++exponent) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      if (digit > 1.0 && range.high / range.low > kMostSpan) continue;
      const double tick = digit * std::pow(10.0, exponent);
      if (tick >= range.low && tick <= range.high) ticks.push_back(tick);
    }
  }
  return ticks;
}

Chart::Chart(Svg& svg, const Box& outer, std::string_view title, Axis x, Axis y)
    : svg_(svg),
      frame_{outer.x + 58, outer.y + 28, outer.width - 70, outer.height - 74},
      x_(std::move(x)),
      y_(std::move(y)) {
  const double bottom = frame_.y + frame_.height;
  const double right = frame_.x + frame_.width;
  for (const double tick : Ticks(x_.range)) {
    const double at = At(tick, y_.range.low).x;
    svg_.Line({at, frame_.y}, {at, bottom}, kGridColor);
    svg_.Text({at, bottom + 16}, x_.format(tick),
              {.size = kTextSize, .color = kAxisColor, .anchor = Anchor::kMiddle});
  }
  for (const double tick : Ticks(y_.range)) {
    const double at = At(x_.range.low, tick).y;
    svg_.Line({frame_.x, at}, {right, at}, kGridColor);
    svg_.Text({frame_.x - 6, at + 4}, y_.format(tick),
              {.size = kTextSize, .color = kAxisColor, .anchor = Anchor::kEnd});
  }
  svg_.Polyline(std::vector<Point>{{frame_.x, frame_.y}, {frame_.x, bottom}, {right, bottom}},
                kAxisColor, 1.0);
  svg_.Text({frame_.x, outer.y + 18}, title, {.size = 14, .bold = true});
  svg_.Text({frame_.x + frame_.width / 2, bottom + 34}, x_.title,
            {.size = kTextSize, .anchor = Anchor::kMiddle});
  svg_.Text({outer.x + 14, frame_.y + frame_.height / 2}, y_.title,
            {.size = kTextSize, .anchor = Anchor::kMiddle, .upward = true});
}

Point Chart::At(double x, double y) const {
  return {frame_.x + frame_.width * Fraction(x_.range, x),
          frame_.y + frame_.height * (1.0 - Fraction(y_.range, y))};
}

void Chart::Curve(const std::vector<Point>& points, std::string_view color, double width) {
  constexpr double kStep = 3.0;
  svg_.Polyline(points, color, width);
  for (size_t i = 1; i < points.size(); ++i) {
    const Point& from = points[i - 1];
    const Point step{points[i].x - from.x, points[i].y - from.y};
    const int steps = 1 + static_cast<int>(std::hypot(step.x, step.y) / kStep);
    for (int k = 0; k <= steps; ++k) {
      const double part = static_cast<double>(k) / steps;
      curves_.push_back({from.x + part * step.x - 1, from.y + part * step.y - 1, 2, 2});
    }
  }
}

void Chart::Mark(Marker marker, Point at, std::string_view color, bool hollow) {
  constexpr double kHalf = 6.0;
  svg_.Mark(marker, at, color, hollow);
  taken_.push_back({at.x - kHalf, at.y - kHalf, 2 * kHalf, 2 * kHalf});
}

void Chart::Label(Point beside, std::string_view text, const TextStyle& style) {
  const double width = TextWidth(text, style.size);
  const double height = style.size;
  constexpr double kGap = 8.0;
  // Offsets of the box's corner: below left first, since curves fall to the right.
  const std::array<Point, 10> offsets = {{{-width - 2, kGap - 1},
                                          {2, -height - kGap + 1},
                                          {kGap, -height / 2},
                                          {-width - kGap, -height / 2},
                                          {-width / 2, kGap},
                                          {-width / 2, -height - kGap},
                                          {2, kGap - 1},
                                          {-width - 2, -height - kGap + 1},
                                          {-width / 2, 2 * kGap + 2},
                                          {-width / 2, -height - 2 * kGap - 2}}};
  const auto free_of = [](const Box& box, const std::vector<Box>& others) {
    return std::none_of(others.begin(), others.end(),
                        [&](const Box& other) { return Overlaps(box, other); });
  };
  for (const bool avoid_curves : {true, false}) {
    for (const Point& offset : offsets) {
      const Box box{beside.x + offset.x, beside.y + offset.y, width, height};
      const bool inside = box.x >= frame_.x && box.y >= frame_.y &&
                          box.x + width <= frame_.x + frame_.width &&
                          box.y + height <= frame_.y + frame_.height;
      if (!inside || !free_of(box, taken_) || (avoid_curves && !free_of(box, curves_))) continue;
      TextStyle placed = style;
      placed.anchor = Anchor::kMiddle;
      svg_.Text({box.x + width / 2, box.y + 0.85 * height}, text, placed);
      taken_.push_back(box);
      return;
    }
  }
}

}  // namespace halflight::report
