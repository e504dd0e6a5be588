// Adds up the optical depth of many particles on one ray, four at a time.
// Chooses no particles: those it is given all count, wherever along the ray they lie.
#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "renderer/scene.h"

namespace halflight::reference {

// Of particles in the order in which they are added; all of the same length, z empty for parallel
// rays.
struct ParticleColumns {
  std::vector<double> x;  // centres across parallel rays, or from the rays' point
  std::vector<double> y;
  std::vector<double> z;
  std::vector<double> inverse_square_radius;
  std::vector<double> optical_depth;  // at the centre
};

// Elements [begin, end), on the parallel ray through `place`. Stops early, where the sum is already
// above `enough`. The same elements give the same bits on every machine.
double SumAcross(const ParticleColumns& particles, Profile profile, size_t begin, size_t end,
                 const glm::dvec2& place, double enough);

// The same on the ray from the origin in `direction`, of unit length; what lies behind the origin
// does not count.
double SumFromPoint(const ParticleColumns& particles, Profile profile, size_t begin, size_t end,
                    const glm::dvec3& direction, double enough);

}  // namespace halflight::reference
