// Particles as a field of extinction whose projections are the image model's optical depths, found
// through a grid of cells. Lit from outside; draws nothing.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/reference/cloud.h"
#include "tests/monte_carlo/photon.h"

namespace halflight::monte_carlo {

// Of particle i at distance d < r from its centre, whose integral along a ray at impact parameter b
// is tau w(b / r):
//   BALL  tau / (2 r)                              the chord is 2 r sqrt(1 - (b / r)^2)
//   SOFT  2 tau / (pi r) * sqrt(1 - (d / r)^2)     half an ellipse over the chord, of area
//                                                  pi / 2 * r * (1 - (b / r)^2)
// Extinctions of overlapping particles add up.
double Extinction(const reference::Particle& particle, Profile profile, double squared_distance);

// The integral of a particle's extinction over space: a cross-section.
double CrossSection(const reference::Particle& particle, Profile profile);

class ParticleMedium {
 public:
  // `density` multiplies all extinctions, as a light's shadow density does.
  ParticleMedium(const reference::Cloud& cloud, double density);

  // A particle at a place, and its own extinction there.
  struct Contribution {
    uint32_t particle;
    double extinction;
  };

  struct Flight {
    glm::dvec3 end{0.0};
    double majorant = 0.0;
    double extinction = 0.0;
    std::vector<Contribution> particles;  // that `extinction` is the sum of
  };

  bool Fly(const Photon& photon, Random& random, Flight& flight) const;

  [[nodiscard]] const reference::Cloud& cloud() const { return cloud_; }
  [[nodiscard]] double density() const { return density_; }
  // Of the box that holds all of every particle.
  [[nodiscard]] const glm::dvec3& low() const { return low_; }
  [[nodiscard]] const glm::dvec3& high() const { return high_; }

 private:
  [[nodiscard]] size_t CellAt(const glm::ivec3& cell) const {
    return (static_cast<size_t>(cell.z) * static_cast<size_t>(cells_.y) +
            static_cast<size_t>(cell.y)) *
               static_cast<size_t>(cells_.x) +
           static_cast<size_t>(cell.x);
  }
  template <typename Visit>
  void VisitCells(const reference::Particle& particle, const Visit& visit) const;
  void Meet(size_t cell, Flight& flight) const;

  const reference::Cloud& cloud_;
  double density_;
  glm::dvec3 low_{0.0};
  glm::dvec3 high_{0.0};
  double cell_size_ = 1.0;
  glm::ivec3 cells_{1};
  std::vector<uint32_t> begin_;      // of each cell's particles, and one past the last cell's
  std::vector<uint32_t> particles_;  // cell after cell
  std::vector<double> majorant_;     // of each cell
};

}  // namespace halflight::monte_carlo
