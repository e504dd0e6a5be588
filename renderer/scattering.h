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

// The moments of a thin beam at a depth, per axis across it: variance of the direction, covariance
// of direction and place, variance of the place.
struct SpreadMoments {
  double angular = 0.0;
  double covariance = 0.0;
  double lateral = 0.0;

  // Through a homogeneous layer of this thickness and scattering coefficient: the moment equations
  // of Lewis 1950 ("Multiple scattering in an infinite medium", Phys. Rev. 78, 526) for the phase
  // function of Henyey and Greenstein, of which the small-angle theory of Fermi and Eyges,
  // lateral variance = b (1 - g^2) s^3 / 9, is the limit for small b s.
  void Advance(double thickness, double scattering_coefficient, double mean_cosine);
};

// How far light of each colour spreads on its way through a cloud.
class PhysicalSpread {
 public:
  // Positions are along `axis`, a unit vector, from the centre of the particles' bounds, as in
  // ParticleOrder. Takes the cloud as layers across the axis, each homogeneous: its scattering
  // coefficient is the mean over where the light meets the cloud, weighted by the light left.
  PhysicalSpread(const ParticleView& particles, const Light& light, const glm::dvec3& axis,
                 const PhysicalScattering& scattering, Profile profile);

  // Squared world units per axis, of the light that has come from before the cloud to this
  // position; never falls along the axis. Infinity is behind the cloud.
  [[nodiscard]] glm::dvec3 VarianceAt(double position) const;

 private:
  double begin_ = 0.0;
  double layer_ = 0.0;  // length along the axis; 0: a cloud without depth
  std::vector<glm::dvec3> variance_{glm::dvec3(0.0)};  // at the layers' edges
};

}  // namespace halflight
