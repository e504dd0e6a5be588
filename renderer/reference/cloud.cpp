// The formulas for one particle, from the image model; see cloud.h.
#include "renderer/reference/cloud.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

namespace halflight::reference {
namespace {

template <typename T>
T ValueOr(const std::vector<T>& values, size_t index, const T& otherwise) {
  return values.empty() ? otherwise : values[index];
}

double CentralDepth(float opacity) {
  return -std::log1p(-static_cast<double>(std::min(opacity, kMaxOpacity)));
}

}  // namespace

Cloud ResolveCloud(const Scene& scene) {
  Cloud cloud;
  cloud.profile = scene.material.profile;
  if (scene.particles == nullptr) return cloud;
  const ParticleSet& set = *scene.particles;
  const Material& material = scene.material;
  const double uniform_depth = CentralDepth(material.opacity);
  cloud.particles.reserve(set.size());
  for (size_t i = 0; i < set.size(); ++i) {
    const glm::dvec3 velocity(ValueOr(set.velocities, i, glm::vec3(0.0F)));
    cloud.particles.push_back(
        {.center = glm::dvec3(set.positions[i]) + scene.time_offset_s * velocity,
         .radius = ValueOr(set.radii, i, material.radius),
         .optical_depth = set.opacities.empty() ? uniform_depth : CentralDepth(set.opacities[i]),
         .color = glm::dvec3(ValueOr(set.colors, i, glm::vec3(1.0F))) * glm::dvec3(material.albedo),
         .emission = glm::dvec3(ValueOr(set.emissions, i, material.emission))});
  }
  if (cloud.particles.empty()) return cloud;
  glm::dvec3 low = cloud.particles.front().center;
  glm::dvec3 high = low;
  for (const Particle& particle : cloud.particles) {
    low = glm::min(low, particle.center);
    high = glm::max(high, particle.center);
  }
  cloud.bounds_center = (low + high) / 2.0;
  return cloud;
}

double OpticalDepthAt(const Particle& particle, Profile profile, double squared_impact) {
  const double remaining = 1.0 - squared_impact / (particle.radius * particle.radius);
  if (remaining <= 0.0) return 0.0;
  return particle.optical_depth * (profile == Profile::kSoft ? remaining : std::sqrt(remaining));
}

}  // namespace halflight::reference
