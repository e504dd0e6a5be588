#include "tests/report/advice.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "tests/measure/timing.h"
#include "tests/report/pareto.h"

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
    std::vector<double> errors;
    for (const Measurement& measurement : results.measurements) {
      const ReportScene& scene = results.scenes[measurement.scene];
      if (measurement.setting != setting || scene.part != Part::kMatrix || !includes(scene)) {
        continue;
      }
      ratios.push_back(measurement.time_ratio);
      errors.push_back(measurement.error.rmse);
    }
    if (ratios.empty()) continue;
    const double worst = *std::max_element(errors.begin(), errors.end());
    summaries.push_back({setting, measure::Median(ratios), worst, measure::Median(errors), false});
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
  // The baseline itself always qualifies: its ratio is 1 by definition.
  const auto affordable = [](const Summary& summary) { return summary.time_ratio <= 1.0; };
  double least = std::numeric_limits<double>::infinity();
  for (const Summary& summary : summaries) {
    if (affordable(summary)) least = std::min(least, summary.median_error);
  }
  std::vector<Summary> good;
  std::copy_if(summaries.begin(), summaries.end(), std::back_inserter(good),
               [&](const Summary& summary) {
                 return affordable(summary) && summary.median_error <= kNearlyAsGood * least;
               });
  return Fastest(good);
}

}  // namespace halflight::report
