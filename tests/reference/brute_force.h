// The image model written down as loops over all particles: no index, no early end, no columns.
// For scenes of a hundred particles and images of a few hundred pixels.
#pragma once

#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "renderer/scene.h"

namespace halflight::reference {

struct BruteForcePixel {
  glm::dvec4 rgba{0.0};
  double depth = 0.0;                     // mean weighted by coverage
  std::vector<glm::dvec3> transmittance;  // by light, likewise
};

// At a place in the camera's window. The set's origin is at zero, and every attribute present.
BruteForcePixel RenderByBruteForce(const Scene& scene, const glm::ivec2& pixel);

}  // namespace halflight::reference
