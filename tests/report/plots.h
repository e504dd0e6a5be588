// The report's plots, as SVG.
#pragma once

#include <string>

#include "tests/report/measure.h"

namespace halflight::report {

// Error against time, one chart for each light of the matrix's scenes of this opacity: the worst
// error of a setting and the median of its times. Curves join settings that differ in slices or
// degree alone; what lies on the Pareto front is filled, joined and labelled.
std::string PlotErrorAgainstTime(const Results& results, const std::string& opacity);

// Time against the number of particles.
std::string PlotScaling(const Results& results);

// The colours of error maps (error_map.h).
std::string PlotErrorScale();

}  // namespace halflight::report
