// The discrete Gaussian: normalised, of exact variance, and a semigroup.
#include "renderer/blur_kernel.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace halflight {
namespace {

// Weight at a signed distance.
double At(const std::vector<float>& kernel, int n) {
  const auto distance = static_cast<size_t>(std::abs(n));
  return distance < kernel.size() ? kernel[distance] : 0.0;
}

class DiscreteGaussianOf : public testing::TestWithParam<double> {};

TEST_P(DiscreteGaussianOf, IsNormalised) {
  const std::vector<float> kernel = DiscreteGaussian(GetParam());
  double sum = 0.0;
  for (int n = -70; n <= 70; ++n) sum += At(kernel, n);
  EXPECT_NEAR(sum, 1.0, 1e-6);
}

TEST_P(DiscreteGaussianOf, HasTheVarianceAskedFor) {
  const std::vector<float> kernel = DiscreteGaussian(GetParam());
  double variance = 0.0;
  for (int n = -70; n <= 70; ++n) variance += n * n * At(kernel, n);
  EXPECT_NEAR(variance, GetParam(), 1e-4 * GetParam() + 1e-6);
}

TEST_P(DiscreteGaussianOf, IsItsHalfAppliedTwice) {
  const std::vector<float> half = DiscreteGaussian(0.5 * GetParam());
  const std::vector<float> whole = DiscreteGaussian(GetParam());
  for (int n = 0; n <= 60; ++n) {
    double convolved = 0.0;
    for (int m = -130; m <= 130; ++m) convolved += At(half, m) * At(half, n - m);
    EXPECT_NEAR(convolved, At(whole, n), 1e-6) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Variances, DiscreteGaussianOf,
                         testing::Values(0.0, 1e-4, 0.05, 0.5, 1.0, 7.3, 50.0, kMaxBlurVariance));

}  // namespace
}  // namespace halflight
