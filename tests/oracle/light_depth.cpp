// Adds up particles along a light's ray; see light_depth.h.
#include "tests/oracle/light_depth.h"

#include <glm/geometric.hpp>

namespace halflight::oracle {

LightDepth::Sums LightDepth::At(const glm::dvec3& x, uint32_t begin, uint32_t end,
                                uint32_t left_out) const {
  const Rays& rays = index_.rays();
  Sums sums;
  // At the light itself no ray is defined, and nothing lies before it.
  if (!rays.parallel() && x == rays.vector()) return sums;
  const glm::dvec3 direction = rays.DirectionAt(x);
  const glm::dvec3 origin = rays.parallel() ? x : rays.vector();
  for (const uint32_t rank : index_.Candidates(x)) {
    if (rank >= end) break;
    if (rank == left_out) continue;
    const Particle& particle = cloud_.particles[order_[rank]];
    const glm::dvec3 offset = particle.center - origin;
    const double along = glm::dot(offset, direction);
    if (!rays.parallel() && along <= 0.0) continue;
    const glm::dvec3 across = offset - along * direction;
    const double depth = OpticalDepthAt(particle, cloud_.profile, glm::dot(across, across));
    (rank < begin ? sums.before : sums.within) += depth;
  }
  return sums;
}

}  // namespace halflight::oracle
