// Means of random values with their standard errors, and the light that particles get.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/monte_carlo/particle_medium.h"

namespace halflight::monte_carlo {

class Mean {
 public:
  void Add(double value) {
    ++count_;
    const double change = value - mean_;
    mean_ += change / static_cast<double>(count_);
    squares_ += change * (value - mean_);
  }
  [[nodiscard]] size_t count() const { return count_; }
  [[nodiscard]] double value() const { return mean_; }
  [[nodiscard]] double standard_error() const;

 private:
  size_t count_ = 0;
  double mean_ = 0.0;
  double squares_ = 0.0;
};

// Light at a particle, as shares of the irradiance of the light's beam: means over the particle,
// weighted by its extinction.
struct ParticleLight {
  std::vector<double> forward_flux;     // through planes across the light, of light travelling on
  std::vector<double> forward_fluence;  // of the same light, whatever its slope
  std::vector<double> fluence;          // of all light
};

// Two independent estimates, so that squared errors can be had without the noise's share: the mean
// of (model - a) (model - b).
struct LightEstimate {
  ParticleLight a;
  ParticleLight b;
};

// Light travelling along `direction` (unit length) falls evenly on the whole cloud. `photons` is
// the number for each of the two estimates. The same seed gives the same values.
LightEstimate EstimateLight(const ParticleMedium& medium, const Scatterer& scatterer,
                            const glm::dvec3& direction, size_t photons, uint64_t seed);

}  // namespace halflight::monte_carlo
