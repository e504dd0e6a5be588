// Every figure of a run as JSON, to be carried from one machine to another.
#pragma once

#include <string>

#include "tests/bench/making.h"
#include "tests/bench/results.h"

namespace halflight::bench {

// One object: how it was made, the goals, then each part's groups with all turns in milliseconds.
std::string WriteFigures(const Results& results, const Making& making);

}  // namespace halflight::bench
