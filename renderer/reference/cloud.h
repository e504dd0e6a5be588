// The particles of a scene with every attribute resolved, in float64 and near the origin.
// Only resolves: nothing here depends on camera or lights.
#pragma once

#include <vector>

#include <glm/vec3.hpp>

#include "renderer/scene.h"

namespace halflight::reference {

struct Particle {
  glm::dvec3 center;  // from the set's origin, at the scene's time
  double radius;
  double optical_depth;  // at the centre: tau
  glm::dvec3 color;      // times the material's albedo
  glm::dvec3 emission;
};

struct Cloud {
  std::vector<Particle> particles;
  glm::dvec3 bounds_center{0.0};  // of the box round the centres
  Profile profile = Profile::kSoft;
};

Cloud ResolveCloud(const Scene& scene);

// The optical depth of a particle at impact parameter b, given b squared.
double OpticalDepthAt(const Particle& particle, Profile profile, double squared_impact);

}  // namespace halflight::reference
