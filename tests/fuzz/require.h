// What fuzz targets hold their subject to. An input for which something does not hold ends the
// program, which is how fuzzers learn of it.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace halflight::fuzz {

inline void Require(bool holds, const std::string& what) {
  if (!holds) {
    std::fprintf(stderr, "does not hold: %s\n", what.c_str());
    std::abort();
  }
}

inline void RequireFinite(double value, const char* what) {
  if (!std::isfinite(value)) {
    Require(false, std::string(what) + " is finite");
  }
}

}  // namespace halflight::fuzz
