#include "tests/bench/goals.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "tests/measure/timing.h"

namespace halflight::bench {
namespace {

// With the bounds.
constexpr double kOverClassic = 4.0;
constexpr double kOverYardstick = 2.0;
constexpr double kSlicesChange = 0.1;
constexpr double kFollowingFrame = 0.7;

const Row* Find(const Group& group, Role role) {
  const auto found = std::find_if(group.begin(), group.end(), [&](const Row& row) {
    return row.role == role && row.failure.empty();
  });
  return found == group.end() ? nullptr : &*found;
}

void JudgeFrame(const Group& frame, std::vector<Goal>& goals) {
  const Row* strictest = nullptr;
  for (const Row& row : frame) {
    if (row.role != Role::kBaseline || !row.error) continue;
    if (strictest == nullptr || row.error->rmse < strictest->error->rmse) strictest = &row;
    const std::optional<Row> best = FastestNoWorseThan(row, frame);
    if (!best) continue;
    goals.push_back({absl::StrCat("times faster than ", row.name), TimeRatio(row, *best),
                     kOverClassic, true, best->name});
  }
  const Row* const yardstick = Find(frame, Role::kYardstick);
  if (yardstick == nullptr || strictest == nullptr) return;
  if (const std::optional<Row> best = FastestNoWorseThan(*strictest, frame)) {
    goals.push_back({"times the yardstick's time", TimeRatio(*best, *yardstick), kOverYardstick,
                     false, best->name});
  }
}

// The largest change against the first of ours, the fewest slices.
void JudgeSlices(const Group& slices, std::vector<Goal>& goals) {
  const Row* const first = Find(slices, Role::kOurs);
  if (first == nullptr) return;
  double change = 0.0;
  int most = first->slices;
  for (const Row& row : slices) {
    if (row.role != Role::kOurs || !row.failure.empty()) continue;
    change = std::max(change, std::abs(TimeRatio(row, *first) - 1.0));
    most = row.slices;
  }
  goals.push_back({absl::StrCat("change of time from ", first->slices, " to ", most, " slices"),
                   change, kSlicesChange, false, first->name});
}

void JudgeTurntable(const Group& turntable, std::vector<Goal>& goals) {
  for (size_t i = 0; i + 1 < turntable.size(); i += 2) {
    const Row& first = turntable[i];
    const Row& following = turntable[i + 1];
    if (first.role != Role::kOurs || !first.failure.empty() || !following.failure.empty()) continue;
    goals.push_back({"a turntable's frame in parts of the first", TimeRatio(following, first),
                     kFollowingFrame, false, following.name});
  }
}

}  // namespace

double TimeRatio(const Row& row, const Row& other) {
  return measure::MedianRatio(row.milliseconds, other.milliseconds);
}

std::optional<Row> FastestNoWorseThan(const Row& judge, const Group& group) {
  const Row* best = nullptr;
  for (const Row& row : group) {
    if (row.role != Role::kOurs || !row.error || row.error->rmse > judge.error->rmse) continue;
    if (best == nullptr ||
        measure::Median(row.milliseconds) < measure::Median(best->milliseconds)) {
      best = &row;
    }
  }
  return best != nullptr ? std::optional(*best) : std::nullopt;
}

std::vector<Goal> JudgeRenderer(const Results& results) {
  std::vector<Goal> goals;
  JudgeFrame(results.frame, goals);
  JudgeSlices(results.slices, goals);
  JudgeTurntable(results.turntable, goals);
  return goals;
}

}  // namespace halflight::bench
