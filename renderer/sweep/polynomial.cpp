#include "renderer/sweep/polynomial.h"

#include <cmath>
#include <utility>

namespace halflight::sweep {

namespace {

// Mean of rho^n over the unit disc weighted by the profile, n even: by integration of
// w(rho) rho^(n + 1).
double RadialMean(Profile profile, int n) {
  if (profile == Profile::kSoft) return 8.0 / ((n + 2) * (n + 4));
  double mean = 1.0;
  for (int k = 2; k <= n; k += 2) mean *= k / (k + 3.0);
  return mean;
}

// Mean of cos^a sin^b over the circle: (a - 1)!! (b - 1)!! / (a + b)!! for even a and b.
double AngularMean(int a, int b) {
  double mean = 1.0;
  for (int k = 1; k < a; k += 2) mean *= k;
  for (int k = 1; k < b; k += 2) mean *= k;
  for (int k = 2; k <= a + b; k += 2) mean /= k;
  return mean;
}

double MonomialMean(Profile profile, int a, int b) {
  return a % 2 == 0 && b % 2 == 0 ? RadialMean(profile, a + b) * AngularMean(a, b) : 0.0;
}

// By Gauss and Jordan; the matrix is positive definite, so that no pivot is needed.
std::vector<double> Inverse(std::vector<double> m, int n) {
  std::vector<double> inverse(m.size(), 0.0);
  for (int i = 0; i < n; ++i) inverse[i * n + i] = 1.0;
  for (int k = 0; k < n; ++k) {
    const double pivot = m[k * n + k];
    for (int j = 0; j < n; ++j) {
      m[k * n + j] /= pivot;
      inverse[k * n + j] /= pivot;
    }
    for (int i = 0; i < n; ++i) {
      const double factor = i == k ? 0.0 : m[i * n + k];
      for (int j = 0; j < n; ++j) {
        m[i * n + j] -= factor * m[k * n + j];
        inverse[i * n + j] -= factor * inverse[k * n + j];
      }
    }
  }
  return inverse;
}

}  // namespace

void Substitute(int degree, std::span<const float> p, const glm::dvec2& of_x,
                const glm::dvec2& of_y, double factor, std::span<float> q) {
  std::array<double, Terms(kMaxDegree)> sum = {};
  // Coefficients of x^i y^(n - i) in u^a v^b, n = a + b, built up factor by factor.
  std::array<double, kMaxDegree + 1> u_power = {1.0};
  for (int a = 0; a <= degree; ++a) {
    std::array<double, kMaxDegree + 1> product = u_power;
    for (int b = 0; a + b <= degree; ++b) {
      const double coefficient = factor * p[TermIndex(degree, a, b)];
      for (int i = 0; i <= a + b; ++i) {
        sum[TermIndex(degree, i, a + b - i)] += coefficient * product[i];
      }
      for (int i = kMaxDegree; i >= 0; --i) {
        product[i] = product[i] * of_y.y + (i > 0 ? product[i - 1] * of_x.y : 0.0);
      }
    }
    for (int i = kMaxDegree; i >= 0; --i) {
      u_power[i] = u_power[i] * of_y.x + (i > 0 ? u_power[i - 1] * of_x.x : 0.0);
    }
  }
  for (int i = 0; i < Terms(degree); ++i) q[i] = static_cast<float>(sum[i]);
}

DiscFit::DiscFit(Profile profile, int degree) : terms_(Terms(degree)) {
  std::vector<std::pair<int, int>> powers;
  for (int a = 0; a <= degree; ++a) {
    for (int b = 0; a + b <= degree; ++b) powers.emplace_back(a, b);
  }
  std::vector<double> gram(powers.size() * powers.size());
  for (size_t i = 0; i < powers.size(); ++i) {
    for (size_t j = 0; j < powers.size(); ++j) {
      gram[i * powers.size() + j] = MonomialMean(profile, powers[i].first + powers[j].first,
                                                 powers[i].second + powers[j].second);
    }
  }
  inverse_gram_ = Inverse(std::move(gram), terms_);
}

void DiscFit::Fit(std::span<const float> weights, std::span<const float> values,
                  std::span<float> polynomial) const {
  std::array<double, Terms(kMaxDegree)> centered = {};
  const double inverse = weights[0] > 0.0F ? 1.0 / weights[0] : 0.0;
  const double mean = values[0] * inverse;
  for (int i = 0; i < terms_; ++i) centered[i] = (values[i] - mean * weights[i]) * inverse;
  for (int i = 0; i < terms_; ++i) {
    double coefficient = i == 0 ? mean : 0.0;
    for (int j = 0; j < terms_; ++j) coefficient += inverse_gram_[i * terms_ + j] * centered[j];
    polynomial[i] = static_cast<float>(coefficient);
  }
}

}  // namespace halflight::sweep
