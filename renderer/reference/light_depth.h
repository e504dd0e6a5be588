// Optical depth between one light and any point, of chosen particles, as an ideal light buffer
// would hold it: evaluated at the point itself, with no texels.
// Knows no slices and no transmittance.
#pragma once

#include <cstdint>
#include <limits>
#include <stop_token>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/reference/cloud.h"
#include "renderer/reference/depth_sum.h"
#include "renderer/reference/ray_index.h"
#include "renderer/reference/rays.h"

namespace halflight::reference {

class LightDepth {
 public:
  // Particles count by their place in `order`, their rank. Soon after `stop` was requested: some of
  // the particles only.
  LightDepth(const Rays& rays, const Cloud& cloud, const std::vector<uint32_t>& order,
             const std::stop_token& stop);

  // Of ranks [begin, end), on the light's ray through x, on which only what lies in front of the
  // light counts. A sum above `enough` may leave out the rest. Any thread.
  [[nodiscard]] double Between(const glm::dvec3& x, uint32_t begin, uint32_t end,
                               double enough = std::numeric_limits<double>::infinity()) const;

  [[nodiscard]] size_t bytes() const;
  // By particle.
  [[nodiscard]] const std::vector<uint32_t>& ranks() const { return ranks_; }

 private:
  Profile profile_;
  RayIndex index_;
  ParticleColumns columns_;  // for each entry of the index
  std::vector<uint32_t> ranks_;
};

// The order in which a particle of a light shades the others: nearest the light first, ties by
// lower index.
std::vector<uint32_t> OrderFromLight(const Rays& rays, const Cloud& cloud,
                                     const std::stop_token& stop);

}  // namespace halflight::reference
