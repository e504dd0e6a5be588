#include "renderer/sweep/polynomial.h"

#include <cmath>
#include <iterator>
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

// Every homogeneous part by Horner's scheme in u: coefficients of x^i y^(k - i), power of x by
// power.
template <int kDegree>
void SubstituteAt(const float* p, const glm::dvec2& of_x, const glm::dvec2& of_y, double factor,
                  float* q) {
  if (kDegree == 0) {
    q[0] = static_cast<float>(factor * p[0]);
    return;
  }
  if (kDegree == 1) {
    const double v = factor * p[1];
    const double u = factor * p[2];
    q[0] = static_cast<float>(factor * p[0]);
    q[1] = static_cast<float>(u * of_y.x + v * of_y.y);
    q[2] = static_cast<float>(u * of_x.x + v * of_x.y);
    return;
  }
  const auto times = [](auto& r, int degree, double x, double y) {
    r[degree + 1] = r[degree] * x;
    for (int i = degree; i > 0; --i) r[i] = r[i] * y + r[i - 1] * x;
    r[0] *= y;
  };
  double v_powers[kDegree + 1][kDegree + 1] = {{1.0}};
  for (int k = 0; k < kDegree; ++k) {
    for (int i = 0; i <= k; ++i) v_powers[k + 1][i] = v_powers[k][i];
    times(v_powers[k + 1], k, of_x.y, of_y.y);
  }
  for (int n = 0; n <= kDegree; ++n) {
    double r[kDegree + 2] = {factor * p[TermIndex(kDegree, n, 0)]};
    for (int k = 1; k <= n; ++k) {
      times(r, k - 1, of_x.x, of_y.x);
      const double coefficient = factor * p[TermIndex(kDegree, n - k, k)];
      for (int i = 0; i <= k; ++i) r[i] += coefficient * v_powers[k][i];
    }
    for (int i = 0; i <= n; ++i) q[TermIndex(kDegree, i, n - i)] = static_cast<float>(r[i]);
  }
}

}  // namespace

void Substitute(int degree, std::span<const float> p, const glm::dvec2& of_x,
                const glm::dvec2& of_y, double factor, std::span<float> q) {
  constexpr void (*kByDegree[])(const float*, const glm::dvec2&, const glm::dvec2&, double,
                                float*) = {SubstituteAt<0>, SubstituteAt<1>, SubstituteAt<2>,
                                           SubstituteAt<3>, SubstituteAt<4>, SubstituteAt<5>,
                                           SubstituteAt<6>};
  static_assert(std::size(kByDegree) == kMaxDegree + 1);
  kByDegree[degree](p.data(), of_x, of_y, factor, q.data());
}

DiscFit::DiscFit(Profile profile, int degree) : degree_(degree) {
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
  inverse_gram_ = Inverse(std::move(gram), Terms(degree));
}

template <int kDegree>
void DiscFit::FitAt(const double* inverse_gram, const float* weights, const float* values,
                    float* polynomial) {
  constexpr int kTerms = Terms(kDegree);
  double centered[kTerms];
  const double inverse = weights[0] > 0.0F ? 1.0 / weights[0] : 0.0;
  const double mean = values[0] * inverse;
  for (int i = 0; i < kTerms; ++i) centered[i] = (values[i] - mean * weights[i]) * inverse;
  for (int a = 0, i = 0; a <= kDegree; ++a) {
    for (int b = 0; a + b <= kDegree; ++b, ++i) {
      double coefficient = i == 0 ? mean : 0.0;
      // Monomials of unlike parity have no product, and none in the inverse.
      for (int c = a % 2; c <= kDegree; c += 2) {
        for (int d = b % 2; c + d <= kDegree; d += 2) {
          const int j = TermIndex(kDegree, c, d);
          coefficient += inverse_gram[i * kTerms + j] * centered[j];
        }
      }
      polynomial[i] = static_cast<float>(coefficient);
    }
  }
}

void DiscFit::Fit(std::span<const float> weights, std::span<const float> values,
                  std::span<float> polynomial) const {
  constexpr void (*kByDegree[])(const double*, const float*, const float*, float*) = {
      FitAt<0>, FitAt<1>, FitAt<2>, FitAt<3>, FitAt<4>, FitAt<5>, FitAt<6>};
  static_assert(std::size(kByDegree) == kMaxDegree + 1);
  kByDegree[degree_](inverse_gram_.data(), weights.data(), values.data(), polynomial.data());
}

}  // namespace halflight::sweep
