#include "tests/report/advice.h"

#include <algorithm>
#include <limits>

#include "tests/report/pareto.h"
#include "tests/report/timing.h"

namespace halflight::report {
namespace {

bool TakesLess(const Summary& a, const Summary& b) { return a.time_ratio < b.time_ratio; }

}  // namespace

std::vector<Summary> Summarize(const Results& results,
                               const std::function<bool(const ReportScene&)>& includes) {
  std::vector<Summary> summaries;
  std::vector<CostAndError> points;
  for (size_t setting = 0; setting < results.settings.size(); ++setting) {
    std::vector<double> ratios;
    double worst = 0.0;
    for (const Measurement& measurement : results.measurements) {
      const ReportScene& scene = results.scenes[measurement.scene];
      if (measurement.setting != setting || scene.part != Part::kMatrix || !includes(scene)) {
        continue;
      }
      ratios.push_back(measurement.time_ratio);
      worst = std::max(worst, measurement.error.rmse);
    }
    if (ratios.empty()) continue;
    summaries.push_back({setting, Median(ratios), worst, false});
    points.push_back({summaries.back().time_ratio, worst});
  }
  const std::vector<bool> front = ParetoFront(points);
  for (size_t i = 0; i < front.size(); ++i) summaries[i].on_front = front[i];
  return summaries;
}

const Summary& Fastest(const std::vector<Summary>& summaries) {
  return *std::min_element(summaries.begin(), summaries.end(), TakesLess);
}

std::optional<Summary> CheapestWithin(const std::vector<Summary>& summaries, double error) {
  std::optional<Summary> cheapest;
  for (const Summary& summary : summaries) {
    if (summary.worst_error > error || (cheapest && !TakesLess(summary, *cheapest))) continue;
    cheapest = summary;
  }
  return cheapest;
}

Summary BestInTimeOfBaseline(const std::vector<Summary>& summaries) {
  constexpr double kNearlyAsGood = 1.1;
  std::vector<Summary> affordable;
  double least = std::numeric_limits<double>::infinity();
  for (const Summary& summary : summaries) {
    // The baseline itself always qualifies: its ratio is 1 by definition.
    if (summary.time_ratio > 1.0) continue;
    affordable.push_back(summary);
    least = std::min(least, summary.worst_error);
  }
  return *CheapestWithin(affordable, kNearlyAsGood * least);
}

}  // namespace halflight::report
