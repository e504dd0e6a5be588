// Stratified random sampling of a finite population, and what a sample says of its mean.
// After Cochran, "Sampling Techniques", 3rd edition, chapters 5 and 5A. Knows nothing of pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace halflight {

// Some of the population, of which a few are drawn.
struct Stratum {
  size_t size = 0;
  std::vector<uint32_t> drawn;  // members of the population, without repetition
};

// Cuts the population into strata of members of similar `expected_size`, such that the sizes of a
// stratum add up to about the same, and draws two members of each (Cochran 5.5: members that may
// be large are drawn more often). Population of `samples` members or fewer: all are drawn, as one
// stratum. `samples` is even. The same seed draws the same members on every machine.
std::vector<Stratum> DrawStrata(std::span<const double> expected_size, size_t samples,
                                uint64_t seed);

// An unbiased estimate of the population's mean, and of the variance of that estimate, which is 0
// where all members are drawn.
struct MeanEstimate {
  double mean = 0.0;
  double variance = 0.0;
  double degrees_of_freedom = 0.0;  // Satterthwaite's (Cochran 5.16), at least 3
};

// `values` are those of the drawn members, stratum by stratum.
MeanEstimate EstimateMean(std::span<const Stratum> strata, std::span<const double> values);

// The 97.5 % quantile of Student's t distribution, for at least 3 degrees of freedom: within 1 %
// (Abramowitz and Stegun 26.7.5).
double StudentQuantile975(double degrees_of_freedom);

}  // namespace halflight
