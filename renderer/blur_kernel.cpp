#include "renderer/blur_kernel.h"

#include <cmath>

#include <glm/common.hpp>

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

std::vector<BlurStep> BlurSteps(const glm::dvec3& variance, int size) {
  std::vector<BlurStep> steps;
  // Light spread further than the buffer is wide is the same everywhere.
  glm::dvec3 left = glm::clamp(variance, 0.0, std::pow(size, 2));
  for (uint32_t stride = 1; left.r > 0.0 || left.g > 0.0 || left.b > 0.0; stride *= 4) {
    const double squared_stride = stride * stride;
    const glm::dvec3 now = glm::min(left, glm::dvec3(kMaxBlurVariance * squared_stride));
    steps.push_back({stride, now / squared_stride});
    left -= now;
  }
  return steps;
}

}  // namespace halflight
