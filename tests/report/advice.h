// What the measurements say to use: settings summed up over scenes, and the cheapest that will do.
// Leaves out how it is said; see page.h.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "tests/report/measure.h"

namespace halflight::report {

// A setting over several scenes.
struct Summary {
  size_t setting;      // in Results::settings
  double time_ratio;   // the median of the scenes'
  double worst_error;  // RMSE, the largest of the scenes'
  double median_error;
  bool on_front;  // among the summaries of the same scenes
};

// Of the scenes of the matrix that `includes` holds for; in the order of the settings. Empty where
// it holds for none.
std::vector<Summary> Summarize(const Results& results,
                               const std::function<bool(const ReportScene&)>& includes);

const Summary& Fastest(const std::vector<Summary>& summaries);

// The cheapest whose error is no larger in any of the scenes.
std::optional<Summary> CheapestWithin(const std::vector<Summary>& summaries, double error);

// The most accurate that takes no longer than the baseline, by the median error: worst cases alone
// would not tell a blurred image from a sharp one, since shadows err by more. The cheapest of those
// that err by at most a tenth more than the best of them.
Summary BestInTimeOfBaseline(const std::vector<Summary>& summaries);

}  // namespace halflight::report
