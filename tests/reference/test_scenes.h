// Small scenes whose rays are known, for the tests of the reference.
// Holds no expected images but one pixel.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight::reference {

// A square image of odd size, whose middle pixel looks along world -z from (0, 0, 10).
inline Scene EmptyScene(int size = 33) {
  Scene scene;
  scene.particles = std::make_shared<ParticleSet>();
  scene.camera.view_from_world = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.0, -10.0));
  scene.camera.projection = Perspective{0.4};
  scene.camera.width = scene.camera.height = size;
  scene.camera.window = {0, 0, size, size};
  scene.material.radius = 1.0F;
  scene.material.opacity = 0.5F;
  scene.material.ambient = glm::vec3(0.0F);
  return scene;
}

inline Scene SceneOf(std::vector<glm::vec3> positions, int size = 33) {
  Scene scene = EmptyScene(size);
  auto set = std::make_shared<ParticleSet>();
  set->positions = std::move(positions);
  scene.particles = set;
  return scene;
}

// Two particles behind each other, lit from the eye's side: the nearer shades the farther.
struct ShadedPair {
  Scene scene = SceneOf({{0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, -1.0F}});
  // Half of the near one's light, then a quarter of what reaches the far one.
  glm::dvec4 middle_pixel{0.5 + 0.25 * 0.5, 0.5 + 0.25 * 0.25, 0.5 + 0.25, 0.75};

  ShadedPair() {
    Light light;
    light.kind = DirectionalLight{{0.0, 0.0, -1.0}};
    light.shadow_density = {1.0F, 2.0F, 0.0F};
    scene.lights = {light};
  }
};

// Particles of random place, radius, opacity and colour in a box round the origin.
inline Scene RandomScene(size_t count, int size, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> signed_unit(-1.0F, 1.0F);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  auto set = std::make_shared<ParticleSet>();
  for (size_t i = 0; i < count; ++i) {
    set->positions.emplace_back(signed_unit(random), signed_unit(random), signed_unit(random));
    set->radii.push_back(0.1F + 0.5F * unit(random) * unit(random));
    set->opacities.push_back(0.7F * unit(random));
    set->colors.emplace_back(unit(random), unit(random), unit(random));
    set->emissions.emplace_back(0.1F * unit(random), 0.0F, 0.0F);
    set->velocities.emplace_back(0.0F, signed_unit(random), 0.0F);
  }
  Scene scene = EmptyScene(size);
  scene.particles = set;
  scene.material.ambient = {0.1F, 0.05F, 0.2F};
  scene.material.phase_g = 0.3F;
  return scene;
}

// The direction through the middle of a pixel of EmptyScene's camera.
inline glm::dvec3 RayOf(const Scene& scene, const glm::ivec2& pixel) {
  const double size = scene.camera.width;
  const double slope = std::tan(std::get<Perspective>(scene.camera.projection).vertical_fov / 2.0);
  return glm::normalize(glm::dvec3((2.0 * (pixel.x + 0.5) / size - 1.0) * slope,
                                   (1.0 - 2.0 * (pixel.y + 0.5) / size) * slope, -1.0));
}

// The frame that shows these pixels.
inline Image BeautyOf(const std::vector<glm::dvec4>& rgba, int width) {
  Image image{width, static_cast<int>(rgba.size()) / width, 1, {"R", "G", "B", "A"}, {}};
  for (const glm::dvec4& pixel : rgba) {
    for (int c = 0; c < 4; ++c) image.pixels.push_back(static_cast<float>(pixel[c]));
  }
  return image;
}

inline void ExpectNear(const glm::dvec4& value, const glm::dvec4& expected,
                       double tolerance = 1e-12) {
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(value[i], expected[i], tolerance) << "channel " << i;
}

}  // namespace halflight::reference
