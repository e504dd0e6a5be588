// A sum of positive terms whose rates are learnt from measured sums: what predicts times and
// errors. Knows nothing of either. Not thread-safe.
#pragma once

#include <span>
#include <vector>

namespace halflight {

struct LearnedSumOptions {
  // How many observations the first rates are worth.
  double prior_observations = 1.0;
  // Of a deviation, the part that is believed however much was observed before, (0, 1].
  double least_gain = 0.2;
  // Typical |ln(measured / predicted)| of the first rates.
  double spread = 0.5;
};

// Rates are corrected in the logarithm, each by its share of the prediction, so that they stay
// positive and that a rate which matters little to an observation changes little by it. A deviation
// counts for no more than kClip times the deviations usual of late: an outlier moves the rates by
// little, a change that stays moves them all the way.
class LearnedSum {
 public:
  LearnedSum(std::vector<double> rates, const LearnedSumOptions& options);

  // `terms`: as many as rates, >= 0. 0 where all terms are.
  [[nodiscard]] double Predict(std::span<const double> terms) const;

  // That the sum of rates times terms was `measured`. Ignored where this or the prediction is not
  // positive and finite.
  void Learn(std::span<const double> terms, double measured);

  // Typical |ln(measured / predicted)| of late.
  [[nodiscard]] double spread() const { return spread_; }
  [[nodiscard]] double observations() const { return observations_; }

 private:
  static constexpr double kClip = 3.0;

  LearnedSumOptions options_;
  std::vector<double> rates_;
  double spread_;
  double observations_ = 0.0;
};

}  // namespace halflight
