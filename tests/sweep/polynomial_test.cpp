// Polynomials and their fits on the disc, against direct evaluation and against polynomials that a
// fit must give back.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "renderer/sweep/polynomial.h"

namespace halflight::sweep {
namespace {

double Value(int degree, const std::vector<float>& p, double x, double y) {
  double value = 0.0;
  for (int a = 0; a <= degree; ++a) {
    for (int b = 0; a + b <= degree; ++b) {
      value += p[TermIndex(degree, a, b)] * std::pow(x, a) * std::pow(y, b);
    }
  }
  return value;
}

std::vector<float> RandomPolynomial(int degree, std::mt19937& random) {
  std::vector<float> p(Terms(degree));
  for (float& coefficient : p) coefficient = static_cast<float>(random()) * 0x1p-31F - 1.0F;
  return p;
}

TEST(Substitute, IsThePolynomialOfTheOtherCoordinates) {
  std::mt19937 random(1);
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    const std::vector<float> p = RandomPolynomial(degree, random);
    std::vector<float> q(p.size());
    const glm::dvec2 of_x(0.6, -0.3);
    const glm::dvec2 of_y(0.2, 0.9);
    Substitute(degree, p, of_x, of_y, 1.5, q);
    for (const glm::dvec2 at : {glm::dvec2(0.3, -0.7), glm::dvec2(-0.9, 0.1)}) {
      const glm::dvec2 uv = at.x * of_x + at.y * of_y;
      EXPECT_NEAR(Value(degree, q, at.x, at.y), 1.5 * Value(degree, p, uv.x, uv.y), 1e-5) << degree;
    }
  }
}

class DiscFitOf : public testing::TestWithParam<Profile> {};

// The products of the monomials are integrals over the disc, so that the grid's sums differ.
TEST_P(DiscFitOf, PolynomialsOfItsDegreeGivesThemBack) {
  constexpr int kAcross = 400;
  std::mt19937 random(2);
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    const std::vector<float> p = RandomPolynomial(degree, random);
    std::vector<double> weights(p.size());
    std::vector<double> values(p.size());
    for (int i = 0; i < kAcross * kAcross; ++i) {
      const double x = (i % kAcross + 0.5) * 2.0 / kAcross - 1.0;
      const double y = (i / kAcross + 0.5) * 2.0 / kAcross - 1.0;
      const double inside = std::max(0.0, 1.0 - x * x - y * y);
      const double w = GetParam() == Profile::kBall ? std::sqrt(inside) : inside;
      const double value = Value(degree, p, x, y);
      for (int a = 0; a <= degree; ++a) {
        for (int b = 0; a + b <= degree; ++b) {
          const double monomial = w * std::pow(x, a) * std::pow(y, b);
          weights[TermIndex(degree, a, b)] += monomial;
          values[TermIndex(degree, a, b)] += monomial * value;
        }
      }
    }
    std::vector<float> fit(p.size());
    DiscFit(GetParam(), degree)
        .Fit(std::vector<float>(weights.begin(), weights.end()),
             std::vector<float>(values.begin(), values.end()), fit);
    for (size_t i = 0; i < p.size(); ++i) EXPECT_NEAR(fit[i], p[i], 2e-2) << degree << " " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Profile, DiscFitOf, testing::Values(Profile::kSoft, Profile::kBall));

TEST(DiscFit, WithoutSamplesIsZero) {
  const std::array<float, Terms(2)> none = {};
  std::array<float, Terms(2)> fit = {1, 1, 1, 1, 1, 1};
  DiscFit(Profile::kSoft, 2).Fit(none, none, fit);
  for (const float coefficient : fit) EXPECT_EQ(coefficient, 0.0F);
}

}  // namespace
}  // namespace halflight::sweep
