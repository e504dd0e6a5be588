// Polynomials of two variables as the kernels keep them, and least squares on the unit disc.
#pragma once

#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "renderer/scene.h"
#include "renderer/sweep/kernels.h"

namespace halflight::sweep {

// Where the coefficient of x^a y^b stands.
constexpr int TermIndex(int degree, int a, int b) { return a * (degree + 1) - a * (a - 1) / 2 + b; }

// q(x, y) = factor * p(u, v), where u = x along.x.x + y along.y.x ... : (u, v) = x * of_x + y *
// of_y.
void Substitute(int degree, std::span<const float> p, const glm::dvec2& of_x,
                const glm::dvec2& of_y, double factor, std::span<float> q);

// Fits f by least squares on the monomials over the unit disc, weighted by a profile w, from sums
// over samples: of w times each monomial, and of w f times each monomial. The sums give f's mean
// exactly; the monomials' products are taken from integrals over the disc.
class DiscFit {
 public:
  DiscFit(Profile profile, int degree);
  // `weights` and `values` have Terms(degree) sums, as has the polynomial. Zero without samples.
  void Fit(std::span<const float> weights, std::span<const float> values,
           std::span<float> polynomial) const;

  // Inverse of the products of the monomials, scaled so that that of 1 and 1 is 1; Terms(degree)
  // squared.
  [[nodiscard]] const std::vector<double>& inverse_gram() const { return inverse_gram_; }

 private:
  template <int kDegree>
  static void FitAt(const double* inverse_gram, const float* weights, const float* values,
                    float* polynomial);

  int degree_;
  std::vector<double> inverse_gram_;
};

}  // namespace halflight::sweep
