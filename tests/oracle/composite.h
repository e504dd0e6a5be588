// The eye's part: which particles each pixel's ray meets, and how they blend, in float64.
// What light reaches a particle is handed in as functions.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/scene.h"
#include "tests/oracle/cloud.h"
#include "tests/oracle/oracle.h"
#include "tests/oracle/ray_index.h"

namespace halflight::oracle {

// Transmittance, by colour channel, from the light to the point x of a particle.
using Transmittance = std::function<glm::dvec3(const glm::dvec3& x, uint32_t particle)>;

struct PassLight {
  Light light;
  Rays rays;                    // from the set's origin, as the cloud's centres
  Transmittance transmittance;  // none: everything arrives
};

// One walk over a pixel's particles from the nearest to the farthest, which adds some light.
struct Pass {
  std::vector<uint32_t> nearness;  // by particle, 0 nearest; empty: by the distance of x_i
  bool ambient_and_emission = false;
  std::vector<PassLight> lights;
};

// Adds up the passes; coverage, depth and transmittance come from the first of them.
OracleImage Composite(const Scene& scene, const Cloud& cloud, const std::vector<Pass>& passes,
                      const OracleOptions& options);

// The direction in which the camera looks, and where it is, from the set's origin.
glm::dvec3 ViewDirection(const Camera& camera);
glm::dvec3 EyePosition(const Scene& scene);

}  // namespace halflight::oracle
