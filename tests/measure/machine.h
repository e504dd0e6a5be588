// The machine that is measured on, and how much of it was for others.
#pragma once

#include <string>

namespace halflight::measure {

// As the system names it; "unknown CPU" where it does not.
std::string CpuModel();

// CPU seconds so far, all cores together: of all programs and of this one with its children that
// have ended. Stolen time, which a virtual machine did not get, counts as another program's.
struct CpuSeconds {
  double all = 0.0;
  double own = 0.0;
};
CpuSeconds CpuSecondsSoFar();

// Year, month and day, UTC.
std::string Today();

}  // namespace halflight::measure
