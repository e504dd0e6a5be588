#include "renderer/stratified_sample.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace halflight {

namespace {

constexpr size_t kDrawsPerStratum = 2;

// The ends of the strata in a population ordered by size.
std::vector<size_t> CutIntoStrata(std::span<const double> ordered_size, size_t strata) {
  const size_t count = ordered_size.size();
  double left = std::accumulate(ordered_size.begin(), ordered_size.end(), 0.0);
  std::vector<size_t> ends;
  size_t end = 0;
  for (size_t remaining = strata; remaining > 1; --remaining) {
    const double share = left / static_cast<double>(remaining);
    const size_t last = count - (remaining - 1) * kDrawsPerStratum;
    const size_t least = end + kDrawsPerStratum;
    double sum = 0.0;
    while (end < last && (end < least || sum + 0.5 * ordered_size[end] < share)) {
      sum += ordered_size[end++];
    }
    left -= sum;
    ends.push_back(end);
  }
  ends.push_back(count);
  return ends;
}

}  // namespace

std::vector<Stratum> DrawStrata(std::span<const double> expected_size, size_t samples,
                                uint64_t seed) {
  const size_t count = expected_size.size();
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  if (count <= samples) return {Stratum{count, std::move(order)}};
  std::stable_sort(order.begin(), order.end(), [expected_size](uint32_t a, uint32_t b) {
    return expected_size[a] < expected_size[b];
  });
  std::vector<double> ordered_size(count);
  for (size_t i = 0; i < count; ++i) ordered_size[i] = expected_size[order[i]];

  std::mt19937_64 random(seed);
  std::vector<Stratum> strata;
  size_t begin = 0;
  for (const size_t end : CutIntoStrata(ordered_size, samples / kDrawsPerStratum)) {
    const size_t size = end - begin;
    const size_t first = random() % size;
    // Any of the others, evenly.
    const size_t second = (first + 1 + random() % (size - 1)) % size;
    strata.push_back({size, {order[begin + first], order[begin + second]}});
    begin = end;
  }
  return strata;
}

MeanEstimate EstimateMean(std::span<const Stratum> strata, std::span<const double> values) {
  double population = 0.0;
  for (const Stratum& stratum : strata) population += static_cast<double>(stratum.size);
  MeanEstimate estimate;
  if (population == 0.0) return estimate;
  double squared_variances = 0.0;
  size_t begin = 0;
  for (const Stratum& stratum : strata) {
    const size_t draws = stratum.drawn.size();
    const std::span<const double> drawn = values.subspan(begin, draws);
    begin += draws;
    const auto n = static_cast<double>(draws);
    const double weight = static_cast<double>(stratum.size) / population;
    const double mean = std::accumulate(drawn.begin(), drawn.end(), 0.0) / n;
    estimate.mean += weight * mean;
    if (draws == stratum.size) continue;
    double squares = 0.0;
    for (const double value : drawn) squares += (value - mean) * (value - mean);
    // With the correction for what is drawn of a finite stratum.
    const double not_drawn = 1.0 - n / static_cast<double>(stratum.size);
    const double variance = weight * weight * not_drawn * squares / (n * (n - 1.0));
    estimate.variance += variance;
    // The square of an estimated variance is too large by (nu + 2) / nu, nu = n - 1.
    squared_variances += variance * variance / (n + 1.0);
  }
  estimate.degrees_of_freedom = 3.0;
  if (squared_variances > 0.0) {
    estimate.degrees_of_freedom =
        std::max(3.0, estimate.variance * estimate.variance / squared_variances - 2.0);
  }
  return estimate;
}

double StudentQuantile975(double degrees_of_freedom) {
  constexpr double kNormal = 1.959963984540054;  // the same quantile of the normal distribution
  const double z2 = kNormal * kNormal;
  const double v = degrees_of_freedom;
  return kNormal * (1.0 + (z2 + 1.0) / (4.0 * v) + ((5.0 * z2 + 16.0) * z2 + 3.0) / (96.0 * v * v) +
                    (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / (384.0 * v * v * v));
}

}  // namespace halflight
