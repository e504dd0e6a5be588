#include "renderer/blur_kernel.h"

#include <cmath>

#include "shaders/bindings.h"

namespace halflight {

std::vector<float> DiscreteGaussian(double variance) {
  std::vector<double> weights;
  double sum = 0.0;
  for (uint32_t n = 0; n <= shader::kMaxBlurRadius; ++n) {
    const double weight = std::exp(-variance) * std::cyl_bessel_i(static_cast<double>(n), variance);
    weights.push_back(weight);
    sum += n == 0 ? weight : 2.0 * weight;
    if (1.0 - sum < 1e-7) break;
  }
  std::vector<float> normalized;
  normalized.reserve(weights.size());
  for (const double weight : weights) normalized.push_back(static_cast<float>(weight / sum));
  return normalized;
}

}  // namespace halflight
