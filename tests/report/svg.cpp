#include "tests/report/svg.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"

namespace halflight::report {
namespace {

constexpr const char* kGround = "#ffffff";

std::string Escaped(std::string_view text) {
  return absl::StrReplaceAll(std::string(text),
                             {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}});
}

std::string PathOf(std::span<const Point> points, bool closed) {
  std::string path;
  for (size_t i = 0; i < points.size(); ++i) {
    absl::StrAppendFormat(&path, "%s%.1f %.1f", i == 0 ? "M" : "L", points[i].x, points[i].y);
  }
  return closed ? path + "Z" : path;
}

// Corners of a polygon round `at`, alternately at two radii; the first straight above it.
std::vector<Point> Corners(Point at, int count, double radius, double other_radius) {
  std::vector<Point> corners;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    const double r = i % 2 == 0 ? radius : other_radius;
    corners.push_back({at.x + r * std::sin(angle), at.y - r * std::cos(angle)});
  }
  return corners;
}

std::vector<Point> OutlineOf(Marker marker, Point at) {
  switch (marker) {
    case Marker::kCircle:
      return Corners(at, 24, 4.2, 4.2);
    case Marker::kSquare:
      return {{at.x - 3.8, at.y - 3.8},
              {at.x + 3.8, at.y - 3.8},
              {at.x + 3.8, at.y + 3.8},
              {at.x - 3.8, at.y + 3.8}};
    case Marker::kTriangle:
      return Corners(at, 3, 5.4, 5.4);
    case Marker::kDiamond:
      return Corners(at, 4, 5.4, 5.4);
    case Marker::kCross:
      return Corners(at, 8, 5.4, 1.8);
    case Marker::kStar:
      return Corners(at, 10, 6.0, 2.6);
  }
  return {};
}

const char* NameOf(Anchor anchor) {
  switch (anchor) {
    case Anchor::kStart:
      return "start";
    case Anchor::kMiddle:
      return "middle";
    case Anchor::kEnd:
      return "end";
  }
  return "";
}

}  // namespace

Svg::Svg(double width, double height, std::string_view description)
    : text_(absl::StrFormat("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" "
                            "height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" role=\"img\" "
                            "font-family=\"DejaVu Sans, Verdana, sans-serif\">\n<title>%s</title>\n"
                            "<rect width=\"100%%\" height=\"100%%\" rx=\"6\" fill=\"%s\"/>\n",
                            width, height, width, height, Escaped(description), kGround)) {}

void Svg::Line(Point from, Point to, std::string_view color, double width) {
  Polyline(std::vector<Point>{from, to}, color, width);
}

void Svg::Polyline(std::span<const Point> points, std::string_view color, double width) {
  absl::StrAppendFormat(&text_,
                        "<path d=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"%.1f\" "
                        "stroke-linejoin=\"round\"/>\n",
                        PathOf(points, false), std::string(color), width);
}

void Svg::Rectangle(Point corner, double width, double height, std::string_view fill) {
  absl::StrAppendFormat(
      &text_, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\"/>\n",
      corner.x, corner.y, width, height, std::string(fill));
}

void Svg::Text(Point at, std::string_view text, const TextStyle& style) {
  const std::string turn =
      style.upward ? absl::StrFormat(" transform=\"rotate(-90 %.1f %.1f)\"", at.x, at.y) : "";
  absl::StrAppendFormat(
      &text_,
      "<text x=\"%.1f\" y=\"%.1f\" font-size=\"%.0f\" fill=\"%s\" text-anchor=\"%s\"%s%s>%s"
      "</text>\n",
      at.x, at.y, style.size, std::string(style.color), NameOf(style.anchor),
      style.bold ? " font-weight=\"bold\"" : "", turn, Escaped(text));
}

void Svg::Mark(Marker marker, Point at, std::string_view color, bool hollow) {
  const std::string name(color);
  absl::StrAppendFormat(&text_, "<path d=\"%s\" fill=\"%s\" stroke=\"%s\" stroke-width=\"1.5\"/>\n",
                        PathOf(OutlineOf(marker, at), true), hollow ? kGround : name, name);
}

std::string Svg::Finish() const { return absl::StrCat(text_, "</svg>\n"); }

double TextWidth(std::string_view text, double size) {
  constexpr double kWidthOfDigit = 0.64;  // DejaVu Sans, in parts of the size
  size_t characters = 0;
  for (const char c : text) characters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1 : 0;
  return kWidthOfDigit * size * static_cast<double>(characters);
}

}  // namespace halflight::report
