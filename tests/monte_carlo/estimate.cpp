// Follows photons on two threads, one for each estimate; see estimate.h.
#include "tests/monte_carlo/estimate.h"

#include <cmath>
#include <limits>
#include <thread>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace halflight::monte_carlo {
namespace {

// Every tentative collision stands for weight / majorant of path (Spanier 1966, "Two pairs of
// families of estimators for transport problems").
void Estimate(const ParticleMedium& medium, const Scatterer& scatterer, const glm::dvec3& travel,
              size_t photons, uint64_t seed, ParticleLight& light) {
  const reference::Cloud& cloud = medium.cloud();
  for (std::vector<double>* values : {&light.forward_flux, &light.forward_fluence, &light.fluence})
    values->assign(cloud.particles.size(), 0.0);

  // A rectangle across the light, in front of the cloud, that covers it.
  const glm::dvec3 other =
      std::abs(travel.y) > 0.9 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 right = glm::normalize(glm::cross(travel, other));
  const glm::dvec3 up = glm::cross(right, travel);
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high = -low;
  for (const reference::Particle& particle : cloud.particles) {
    const glm::dvec3 place(glm::dot(particle.center, right), glm::dot(particle.center, up),
                           glm::dot(particle.center, travel));
    low = glm::min(low, place - particle.radius);
    high = glm::max(high, place + particle.radius);
  }

  Random random(seed);
  for (size_t n = 0; n < photons; ++n) {
    const double x = glm::mix(low.x, high.x, random.Uniform());
    const double y = glm::mix(low.y, high.y, random.Uniform());
    Follow(medium, scatterer, {x * right + y * up + low.z * travel, travel}, random,
           [&](const Photon& photon, const ParticleMedium::Flight& flight, bool /*leaves*/) {
             const double cosine = glm::dot(photon.direction, travel);
             for (const ParticleMedium::Contribution& met : flight.particles) {
               const double path = photon.weight * met.extinction / flight.majorant;
               light.fluence[met.particle] += path;
               if (cosine > 0.0) {
                 light.forward_fluence[met.particle] += path;
                 light.forward_flux[met.particle] += path * cosine;
               }
             }
             return true;
           });
  }

  const double irradiance = static_cast<double>(photons) / ((high.x - low.x) * (high.y - low.y));
  for (size_t i = 0; i < cloud.particles.size(); ++i) {
    const double whole =
        irradiance * medium.density() * CrossSection(cloud.particles[i], cloud.profile);
    light.forward_flux[i] /= whole;
    light.forward_fluence[i] /= whole;
    light.fluence[i] /= whole;
  }
}

}  // namespace

double Mean::standard_error() const {
  const auto n = static_cast<double>(count_);
  return n > 1.0 ? std::sqrt(squares_ / (n * (n - 1.0))) : std::numeric_limits<double>::infinity();
}

LightEstimate EstimateLight(const ParticleMedium& medium, const Scatterer& scatterer,
                            const glm::dvec3& direction, size_t photons, uint64_t seed) {
  LightEstimate estimate;
  {
    const std::jthread first(
        [&] { Estimate(medium, scatterer, direction, photons, 2 * seed, estimate.a); });
    Estimate(medium, scatterer, direction, photons, 2 * seed + 1, estimate.b);
  }
  return estimate;
}

}  // namespace halflight::monte_carlo
