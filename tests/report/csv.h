// All measurements as comma-separated values, one line each.
#pragma once

#include <string>

#include "tests/report/measure.h"

namespace halflight::report {

// Names hold no commas and need no quotes. Errors are in parts of the reference's mean; a row whose
// rmse_low and rmse_high differ was estimated from a sample, p999 and max being the sample's.
std::string WriteCsv(const Results& results);

}  // namespace halflight::report
