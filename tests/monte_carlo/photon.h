// A photon's way through a medium: flights from one collision to the next, and what happens there.
// Knows no particular medium, and counts nothing: that is the visitor's.
#pragma once

#include <glm/vec3.hpp>

#include "tests/monte_carlo/random.h"

namespace halflight::monte_carlo {

// A bundle of light: absorption takes from its weight.
struct Photon {
  glm::dvec3 position;
  glm::dvec3 direction;  // unit length
  double weight = 1.0;
};

struct Scatterer {
  double mean_cosine = 0.0;  // (-1, 1)
  double albedo = 1.0;       // [0, 1]
};

// A direction after scattering by the phase function of Henyey and Greenstein 1941, whose
// cumulative distribution is inverted exactly.
glm::dvec3 Scattered(const glm::dvec3& direction, double mean_cosine, Random& random);

// Follows the photon until it leaves the medium or has no weight left.
//   bool Medium::Fly(const Photon&, Random&, Flight&) const   false: the photon leaves; else the
//       place of its next tentative collision, `medium` there of `majorant` (delta tracking:
//       Woodcock et al. 1965), the rest being collisions with nothing
//   bool visit(const Photon&, const Flight&, bool leaves)   sees every flight; false ends the walk
template <typename Medium, typename Visit>
void Follow(const Medium& medium, const Scatterer& scatterer, Photon photon, Random& random,
            const Visit& visit) {
  // Below this weight a photon is given up in fair proportion (Russian roulette).
  constexpr double kLeastWeight = 1e-3;
  typename Medium::Flight flight;
  for (;;) {
    const bool leaves = !medium.Fly(photon, random, flight);
    if (!visit(photon, flight, leaves) || leaves) return;
    photon.position = flight.end;
    if (random.Uniform() * flight.majorant >= flight.extinction) continue;
    photon.weight *= scatterer.albedo;
    if (photon.weight <= 0.0) return;
    if (photon.weight < kLeastWeight) {
      if (random.Uniform() < 0.9) return;
      photon.weight *= 10.0;
    }
    photon.direction = Scattered(photon.direction, scatterer.mean_cosine, random);
  }
}

}  // namespace halflight::monte_carlo
