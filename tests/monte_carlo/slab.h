// A homogeneous layer between z = 0 and z = thickness, without end across.
// Its light is followed exactly: every collision is a real one.
#pragma once

#include <limits>

#include "tests/monte_carlo/photon.h"

namespace halflight::monte_carlo {

struct Slab {
  double extinction = 1.0;
  // Infinite: a medium without surfaces.
  double thickness = std::numeric_limits<double>::infinity();

  struct Flight {
    glm::dvec3 end{0.0};  // of the flight, which is the surface where the photon leaves
    double length = 0.0;
    double majorant = 0.0;
    double extinction = 0.0;
  };

  bool Fly(const Photon& photon, Random& random, Flight& flight) const {
    flight.length = random.Exponential() / extinction;
    flight.majorant = flight.extinction = extinction;
    bool stays = true;
    if (thickness < std::numeric_limits<double>::infinity()) {
      const double slope = photon.direction.z;
      const double to_surface = slope > 0.0   ? (thickness - photon.position.z) / slope
                                : slope < 0.0 ? -photon.position.z / slope
                                              : std::numeric_limits<double>::infinity();
      stays = flight.length < to_surface;
      if (!stays) flight.length = to_surface;
    }
    flight.end = photon.position + flight.length * photon.direction;
    return stays;
  }
};

}  // namespace halflight::monte_carlo
