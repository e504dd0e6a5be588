#include "renderer/target/learned_sum.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace halflight {

LearnedSum::LearnedSum(std::vector<double> rates, const LearnedSumOptions& options)
    : options_(options), rates_(std::move(rates)), spread_(options.spread) {}

double LearnedSum::Predict(std::span<const double> terms) const {
  return std::inner_product(terms.begin(), terms.end(), rates_.begin(), 0.0);
}

void LearnedSum::Learn(std::span<const double> terms, double measured) {
  constexpr double kLeastSpread = 0.05;
  constexpr double kSpreadGain = 0.25;
  const double predicted = Predict(terms);
  const double deviation = std::log(measured / predicted);
  if (!std::isfinite(deviation)) return;
  const double most = kClip * std::max(spread_, kLeastSpread);
  const double believed = std::clamp(deviation, -most, most);
  const double gain =
      std::max(options_.least_gain, 1.0 / (observations_ + options_.prior_observations + 1.0));

  // A step along the shares changes the prediction's logarithm by the sum of their squares.
  double squares = 0.0;
  for (size_t i = 0; i < rates_.size(); ++i) {
    const double share = rates_[i] * terms[i] / predicted;
    squares += share * share;
  }
  for (size_t i = 0; i < rates_.size(); ++i) {
    const double share = rates_[i] * terms[i] / predicted;
    rates_[i] *= std::exp(gain * believed * share / squares);
  }
  spread_ += kSpreadGain * (std::abs(believed) - spread_);
  observations_ += 1.0;
}

}  // namespace halflight
