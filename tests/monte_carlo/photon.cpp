// Samples the phase function; see photon.h.
#include "tests/monte_carlo/photon.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace halflight::monte_carlo {

glm::dvec3 Scattered(const glm::dvec3& direction, double mean_cosine, Random& random) {
  const double g = mean_cosine;
  const double u = random.Uniform();
  double cosine = 2.0 * u - 1.0;
  if (std::abs(g) > 1e-6) {
    const double s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    cosine = std::clamp((1.0 + g * g - s * s) / (2.0 * g), -1.0, 1.0);
  }
  const double sine = std::sqrt(1.0 - cosine * cosine);
  const double azimuth = 2.0 * std::numbers::pi * random.Uniform();
  const glm::dvec3 other =
      std::abs(direction.z) < 0.7 ? glm::dvec3(0.0, 0.0, 1.0) : glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 u_axis = glm::normalize(glm::cross(direction, other));
  const glm::dvec3 v_axis = glm::cross(direction, u_axis);
  return glm::normalize(cosine * direction +
                        sine * (std::cos(azimuth) * u_axis + std::sin(azimuth) * v_axis));
}

}  // namespace halflight::monte_carlo
