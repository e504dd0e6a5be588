// How a run was made: machine, renderer, version.
#pragma once

#include <string>

namespace halflight::bench {

struct Making {
  std::string cpu;
  unsigned cores = 0;
  double others = 0.0;  // part of the cores that other programs took meanwhile
  std::string gl_renderer;
  std::string gl_version;
  std::string version;
  std::string date;
  std::string command;
  bool short_form = false;  // its figures mean nothing, which the page then says
};

}  // namespace halflight::bench
