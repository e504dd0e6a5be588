// The machine that the report is made on.
#pragma once

#include <string>

namespace halflight::measure {

// As the system names it; "unknown CPU" where it does not.
std::string CpuModel();

// Year, month and day, UTC.
std::string Today();

}  // namespace halflight::measure
