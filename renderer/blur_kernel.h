// Weights of the light's sideways spread. No GL.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

namespace halflight {

// The discrete Gaussian of Lindeberg 1990 ("Scale-space for discrete signals", eq. 19),
// T(n, v) = exp(-v) I_n(v): weights by distance n >= 0 in texels, cut where the rest is below 1e-7
// and normalised so that weight 0 plus twice the others is 1. Unlike a sampled Gaussian its
// variance is exactly v however small v is, and two kernels applied in turn give exactly the one of
// the summed variance: many small steps blur as one large one does. `variance` in squared texels,
// at most kMaxBlurVariance.
std::vector<float> DiscreteGaussian(double variance);

// The kernel of this variance still fits into shader::kMaxBlurRadius.
inline constexpr double kMaxBlurVariance = 100.0;

// One pass of a blur along one axis: of every stride-th texel, by the kernel of this variance in
// squared strides, for each colour.
struct BlurStep {
  uint32_t stride = 1;
  glm::dvec3 variance{0.0};
};

// The passes that together blur `size` texels by `variance`, squared texels: kernels applied in
// turn add their variances, and what earlier ones have smoothed, later ones may take in strides, so
// that any width needs a handful. None for no variance.
std::vector<BlurStep> BlurSteps(const glm::dvec3& variance, int size);

}  // namespace halflight
