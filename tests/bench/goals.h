// The goals that speed is held to, as ratios of rows of one run.
#pragma once

#include <optional>
#include <vector>

#include "tests/bench/results.h"

namespace halflight::bench {

// What `row` takes in parts of what `other` takes: the median over turns. Of one group.
double TimeRatio(const Row& row, const Row& other);

// The fastest of ours whose error is no larger than that of `judge`, which has one.
std::optional<Row> FastestNoWorseThan(const Row& judge, const Group& group);

// Of those parts that were measured; what was not has no goal.
std::vector<Goal> JudgeRenderer(const Results& results);

}  // namespace halflight::bench
