// A beam that scatters down a column, and how wide it is at the end.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/renderer/gl_fixture.h"

namespace halflight::test {

// A faint occluder at the top of a column, 2 units long, of particles too faint to shadow, wide
// enough that the light buffer holds the spread occluder. The light travels down the column.
inline Scene ScatteringColumn(const glm::dvec3& eye) {
  Scene scene;
  auto set = std::make_shared<ParticleSet>();
  set->positions.emplace_back(0.0F, 0.0F, 0.0F);
  set->radii.push_back(0.1F);
  set->opacities.push_back(0.01F);
  const glm::vec2 corners[] = {{-1.5F, -1.5F}, {1.5F, -1.5F}, {-1.5F, 1.5F}, {1.5F, 1.5F}};
  for (int k = 0; k < 2048; ++k) {
    const glm::vec2 corner = corners[k % 4];
    set->positions.emplace_back(corner.x, -2.0F * static_cast<float>(k) / 2047.0F, corner.y);
    set->radii.push_back(0.05F);
    set->opacities.push_back(1e-9F);
  }
  scene.particles = set;
  scene.camera = LookAt(eye, {0, -1, 0}, 16, 16);
  scene.lights = {Sun({0, -1, 0})};
  scene.material.scattering_spread = 0.15F;
  scene.shadow.light_buffer_size = 256;
  return scene;
}

// What BeamWidth looks at.
inline FrameRequest BeamOf(const Scene& scene) {
  return {scene, {{ImageKind::kLightBuffer, 0, LightQuantity::kOpticalDepth}}};
}

// Standard deviation along the buffer's x of the optical depth behind all, world units.
inline double BeamWidth(const FrameResult& frame) {
  const Image& image = frame.images[0];
  double sum = 0.0;
  double first = 0.0;
  double second = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double depth = std::max(*PixelAt(image, x, y), 0.0F);
      sum += depth;
      first += depth * x;
      second += depth * x * x;
    }
  }
  const glm::dmat4& texture = frame.lights[0].light_texture_from_world;
  const double texels_per_unit =
      glm::length(glm::dvec3(texture[0][0], texture[1][0], texture[2][0])) * image.width;
  return std::sqrt(second / sum - std::pow(first / sum, 2)) / texels_per_unit;
}

}  // namespace halflight::test
