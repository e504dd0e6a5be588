// How a run was made: machine, renderer, version.
#pragma once

#include <string>

namespace halflight::bench {

struct Making {
  std::string cpu;
  unsigned cores = 0;
  double load = 0.0;  // processes that ran or waited on the machine as the run began
  std::string gl_renderer;
  std::string gl_version;
  std::string version;
  std::string date;
  std::string command;
  bool short_form = false;  // its figures mean nothing, which the page then says
};

}  // namespace halflight::bench
