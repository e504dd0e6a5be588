#include "tests/report/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/report/advice.h"
#include "tests/report/chart.h"
#include "tests/report/error_map.h"

namespace halflight::report {
namespace {

struct CurveStyle {
  const char* color;
  Marker marker;
};

// Okabe and Ito's colours for the colour-blind, darkened where white ground asks for it; the shapes
// tell curves apart without any.
CurveStyle StyleOf(size_t curve) {
  constexpr std::array<CurveStyle, 8> kStyles = {{
      {"#6e7781", Marker::kCircle},
      {"#0072b2", Marker::kSquare},
      {"#3d9bd1", Marker::kTriangle},
      {"#c75000", Marker::kDiamond},
      {"#b5598f", Marker::kCross},
      {"#1f2328", Marker::kStar},
      {"#00805f", Marker::kCircle},
      {"#a07400", Marker::kSquare},
  }};
  return kStyles[curve % kStyles.size()];
}

constexpr const char* kFrontColor = "#f0dc9a";
// Below this nothing is told apart: the reference, whose error is rounding, is drawn there.
constexpr double kLeastError = 1e-3;

std::string Percent(double value) { return absl::StrFormat("%g %%", 100.0 * value); }
std::string Times(double value) { return absl::StrFormat("%g\u00d7", value); }
std::string Count(double value) {
  return value >= 1e6 ? absl::StrFormat("%gM", value / 1e6) : absl::StrFormat("%gk", value / 1e3);
}

// One entry for each curve, from left to right, in two rows at most. `at` is the first's place.
void DrawKey(Svg& svg, const std::vector<Setting>& settings, Point at, double width) {
  constexpr double kTextSize = 12.0;
  Point pen = at;
  std::optional<size_t> last;
  for (const Setting& setting : settings) {
    if (last == setting.curve_index) continue;
    last = setting.curve_index;
    const double entry = TextWidth(setting.curve, kTextSize) + 26.0;
    if (pen.x + entry > at.x + width) pen = {at.x, pen.y + 18.0};
    const CurveStyle style = StyleOf(setting.curve_index);
    svg.Mark(style.marker, {pen.x, pen.y - 4.0}, style.color, false);
    svg.Text({pen.x + 10.0, pen.y}, setting.curve, {.size = kTextSize, .color = style.color});
    pen.x += entry;
  }
}

void DrawSummaries(Chart& chart, const Results& results, std::vector<Summary> summaries) {
  const auto at = [&](const Summary& summary) {
    return chart.At(summary.time_ratio, summary.worst_error);
  };
  std::vector<Summary> front;
  std::copy_if(summaries.begin(), summaries.end(), std::back_inserter(front),
               [](const Summary& summary) { return summary.on_front; });
  std::sort(front.begin(), front.end(),
            [](const Summary& a, const Summary& b) { return a.time_ratio < b.time_ratio; });
  std::vector<Point> steps;
  for (const Summary& summary : front) steps.push_back(at(summary));
  chart.Curve(steps, kFrontColor, 7.0);

  for (size_t first = 0; first < summaries.size();) {
    const size_t curve = results.settings[summaries[first].setting].curve_index;
    std::vector<Point> points;
    size_t next = first;
    for (;
         next < summaries.size() && results.settings[summaries[next].setting].curve_index == curve;
         ++next) {
      points.push_back(at(summaries[next]));
    }
    chart.Curve(points, StyleOf(curve).color, 1.2);
    first = next;
  }
  for (const Summary& summary : summaries) {
    const CurveStyle style = StyleOf(results.settings[summary.setting].curve_index);
    chart.Mark(style.marker, at(summary), style.color, !summary.on_front);
  }
  for (const bool on_front : {true, false}) {
    for (const Summary& summary : summaries) {
      const Setting& setting = results.settings[summary.setting];
      if (summary.on_front != on_front || (!on_front && !setting.baseline)) continue;
      const std::string label = summary.worst_error < kLeastError ? "exact" : setting.label;
      chart.Label(at(summary), setting.baseline ? label + " (baseline)" : label,
                  {.size = 12.0, .color = StyleOf(setting.curve_index).color});
    }
  }
}

}  // namespace

std::string PlotErrorAgainstTime(const Results& results, const std::string& opacity) {
  constexpr double kWidth = 860.0;
  constexpr double kHeight = 330.0;  // of a chart
  constexpr double kKey = 50.0;
  std::vector<std::pair<std::string, std::vector<Summary>>> groups;
  std::vector<double> times;
  std::vector<double> errors;
  for (const std::string& light : LightNames()) {
    std::vector<Summary> summaries = Summarize(results, [&](const ReportScene& scene) {
      return scene.light == light && scene.opacity == opacity;
    });
    if (summaries.empty()) continue;
    for (const Summary& summary : summaries) {
      times.push_back(summary.time_ratio);
      errors.push_back(std::max(kLeastError, summary.worst_error));
    }
    groups.emplace_back(light, std::move(summaries));
  }
  const Axis time{RangeAround(times), "time, as a multiple of the baseline's", Times};
  const Axis error{RangeAround(errors), "error (RMSE / mean)", Percent};
  const auto rows = static_cast<double>((groups.size() + 1) / 2);
  Svg svg(kWidth, kKey + rows * kHeight,
          absl::StrCat("Error against time, ", opacity, " smoke, by direction of light"));
  DrawKey(svg, results.settings, {20.0, 24.0}, kWidth - 40.0);
  for (size_t i = 0; i < groups.size(); ++i) {
    const Box outer{static_cast<double>(i % 2) * kWidth / 2,
                    kKey + static_cast<double>(i / 2) * kHeight, kWidth / 2, kHeight};
    Chart chart(svg, outer, absl::StrCat(opacity, ", light from the ", LightTitle(groups[i].first)),
                time, error);
    DrawSummaries(chart, results, groups[i].second);
  }
  return svg.Finish();
}

std::string PlotScaling(const Results& results) {
  constexpr double kWidth = 860.0;
  constexpr double kHeight = 400.0;
  constexpr double kKey = 50.0;
  std::vector<double> counts;
  std::vector<double> times;
  for (const Measurement& measurement : results.measurements) {
    const ReportScene& scene = results.scenes[measurement.scene];
    if (scene.part != Part::kScaling) continue;
    counts.push_back(static_cast<double>(scene.scene.particles->size()));
    times.push_back(measurement.time_ratio);
  }
  LogRange range = RangeAround(counts);
  range.high *= 5.0;  // the curves' names stand at their ends
  Svg svg(kWidth, kKey + kHeight, "Time against the number of particles");
  std::vector<Setting> drawn;
  std::copy_if(results.settings.begin(), results.settings.end(), std::back_inserter(drawn),
               [](const Setting& setting) { return setting.scaling_most > 0; });
  DrawKey(svg, drawn, {20.0, 24.0}, kWidth - 40.0);
  Chart chart(svg, {0.0, kKey, kWidth, kHeight}, "Cost against particles",
              {range, "particles", Count},
              {RangeAround(times), "time, as a multiple of the baseline's", Times});
  struct End {
    Point at;
    const Setting* setting;
  };
  std::vector<End> ends;
  for (size_t setting = 0; setting < results.settings.size(); ++setting) {
    const CurveStyle style = StyleOf(results.settings[setting].curve_index);
    std::vector<Point> points;
    for (const Measurement& measurement : results.measurements) {
      const ReportScene& scene = results.scenes[measurement.scene];
      if (scene.part != Part::kScaling || measurement.setting != setting) continue;
      points.push_back(
          chart.At(static_cast<double>(scene.scene.particles->size()), measurement.time_ratio));
    }
    if (points.empty()) continue;
    chart.Curve(points, style.color, 1.5);
    for (const Point& point : points) chart.Mark(style.marker, point, style.color, false);
    ends.push_back({points.back(), &results.settings[setting]});
  }
  for (const End& end : ends) {
    chart.Label(end.at, end.setting->name,
                {.size = 12.0, .color = StyleOf(end.setting->curve_index).color});
  }
  return svg.Finish();
}

std::string PlotErrorScale() {
  constexpr int kSteps = 100;
  constexpr double kLeft = 30.0;
  constexpr double kStep = 4.0;
  Svg svg(2 * kLeft + kSteps * kStep, 56.0, "Colours of the error maps");
  for (int i = 0; i < kSteps; ++i) {
    const auto color = ErrorColor((2.0 * (i + 0.5) / kSteps - 1.0) * kErrorMapEnd);
    svg.Rectangle({kLeft + i * kStep, 8.0}, kStep + 0.5, 18.0,
                  absl::StrFormat("#%02x%02x%02x", color[0], color[1], color[2]));
  }
  for (const double part : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    const std::string text = part == -1.0  ? absl::StrFormat("%g %%", -100 * kErrorMapEnd)
                             : part == 0.0 ? "right"
                                           : absl::StrFormat("%+g %%", 100 * part * kErrorMapEnd);
    svg.Text({kLeft + 0.5 * (part + 1.0) * kSteps * kStep, 44.0}, text,
             {.size = 12.0, .anchor = Anchor::kMiddle});
  }
  return svg.Finish();
}

}  // namespace halflight::report
