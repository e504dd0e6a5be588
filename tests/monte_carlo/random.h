// Random numbers that are the same with every library.
// Not for secrets: the seed says everything.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace halflight::monte_carlo {

class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}

  // In [0, 1).
  double Uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  // Of mean 1: the optical depth that light travels until it meets something.
  double Exponential() { return -std::log1p(-Uniform()); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace halflight::monte_carlo
