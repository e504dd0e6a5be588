// The report's page, in markdown.
#pragma once

#include <string>
#include <vector>

#include "tests/report/advice.h"
#include "tests/report/examples.h"
#include "tests/report/measure.h"

namespace halflight::report {

// What the page says of how it was made.
struct Making {
  std::string cpu;
  unsigned cores;
  std::string gl_renderer;
  std::string gl_version;
  std::string version;
  std::string date;
  std::string command;
  bool short_form;  // its figures mean nothing, which the page then says
};

// What the page advises where nothing more is known.
Summary Advised(const Results& results);

// The page's first part: what to use for which error, over all scenes and by direction of the
// light.
std::string WriteAdvice(const Results& results);

// Refers to the plots as error-dense.svg, error-thin.svg, scaling.svg and error-scale.svg, to the
// table as measurements.csv, and to the examples by their files, all beside it.
std::string WritePage(const Results& results, const std::vector<Example>& examples,
                      const Making& making);

}  // namespace halflight::report
