// What a medium that scatters does to a light on its way: how much of the light is lost, and how
// far it spreads sideways. No GL; knows nothing of slices. Sources, limits and measured errors:
// docs/scattering.md.
#pragma once

#include <vector>

#include <glm/vec3.hpp>

#include "renderer/particle_view.h"
#include "renderer/scene.h"

namespace halflight {

// The share of light scattered once that still travels forward: the integral of the phase function
// of Henyey and Greenstein 1941 over the hemisphere ahead. `mean_cosine` in (-1, 1).
double ForwardFraction(double mean_cosine);

// Extinction of the light that travels forward, as a share of the medium's: what is scattered
// ahead is not lost, 1 - albedo * forward fraction.
double ForwardExtinction(const PhysicalScattering& scattering);

// How far the scattered light of each colour spreads on its way through a cloud; light that has not
// been scattered does not spread.
class PhysicalSpread {
 public:
  // Positions are along `axis`, a unit vector, from the centre of the particles' bounds, as in
  // ParticleOrder. Follows the scattered light of the whole cloud through layers across the axis:
  // how much there is, the variance of its directions and their covariance with place, by the
  // moment equations of Lewis 1950 ("Multiple scattering in an infinite medium", Phys. Rev. 78,
  // 526), of which the small-angle theory of Fermi and Eyges is the limit for thin media.
  PhysicalSpread(const ParticleView& particles, const Light& light, const glm::dvec3& axis,
                 const PhysicalScattering& scattering, Profile profile);

  // Squared world units per axis across the light: light scattered at one position has, at another
  // behind it, the difference of the two. Infinity is behind the cloud.
  [[nodiscard]] glm::dvec3 VarianceAt(double position) const;

 private:
  double begin_ = 0.0;
  double layer_ = 0.0;  // length along the axis; 0: a cloud without depth
  std::vector<glm::dvec3> variance_{glm::dvec3(0.0)};  // at the layers' edges
};

}  // namespace halflight
