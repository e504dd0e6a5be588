// The benchmark's page, in markdown.
#pragma once

#include <string>

#include "tests/bench/making.h"
#include "tests/bench/results.h"

namespace halflight::bench {

std::string WritePage(const Results& results, const Making& making);

}  // namespace halflight::bench
