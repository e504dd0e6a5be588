// Optical depth between one light and any point, of chosen particles, as an ideal light buffer
// would hold it: evaluated at the point itself, with no texels.
// Knows no slices and no transmittance.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "tests/oracle/cloud.h"
#include "tests/oracle/ray_index.h"

namespace halflight::oracle {

class LightDepth {
 public:
  // Particles count by their place in `order`, their rank. `cloud` must outlive this.
  LightDepth(const Rays& rays, const Cloud& cloud, std::vector<uint32_t> order)
      : cloud_(cloud), order_(std::move(order)), index_(rays, cloud, order_) {}

  struct Sums {
    double before = 0.0;  // ranks below `begin`
    double within = 0.0;  // ranks from `begin` on and below `end`
  };

  // Along the light's ray through x, on which only what lies in front of the light counts. The
  // particle of rank `left_out` does not count.
  [[nodiscard]] Sums At(const glm::dvec3& x, uint32_t begin, uint32_t end, uint32_t left_out) const;

  [[nodiscard]] const std::vector<uint32_t>& order() const { return order_; }

 private:
  const Cloud& cloud_;
  std::vector<uint32_t> order_;
  RayIndex index_;
};

}  // namespace halflight::oracle
