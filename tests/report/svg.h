// SVG documents, element by element.
// Knows nothing of axes and data; see chart.h.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace halflight::report {

// In pixels of the document, y downwards.
struct Point {
  double x;
  double y;
};

enum class Anchor { kStart, kMiddle, kEnd };
enum class Marker { kCircle, kSquare, kTriangle, kDiamond, kCross, kStar };

struct TextStyle {
  double size = 12.0;  // pixels
  std::string_view color = "#1f2328";
  Anchor anchor = Anchor::kStart;
  bool bold = false;
  bool upward = false;  // reads from below to above
};

class Svg {
 public:
  // On an opaque light ground, so that it reads on dark pages too. `description` is for those who
  // cannot see it.
  Svg(double width, double height, std::string_view description);

  void Line(Point from, Point to, std::string_view color, double width = 1.0);
  void Polyline(std::span<const Point> points, std::string_view color, double width);
  void Rectangle(Point corner, double width, double height, std::string_view fill);
  void Text(Point at, std::string_view text, const TextStyle& style = {});
  // About nine pixels across; a hollow one is filled with the ground.
  void Mark(Marker marker, Point at, std::string_view color, bool hollow);

  // The whole document.
  [[nodiscard]] std::string Finish() const;

 private:
  std::string text_;
};

// Width of a text in the fonts that Svg asks for, in pixels: an upper estimate.
double TextWidth(std::string_view text, double size);

}  // namespace halflight::report
