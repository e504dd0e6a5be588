// Small scenes for tests: built in code, the same each time.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "renderer/frame.h"
#include "renderer/particle_view.h"

namespace halflight::test {

inline constexpr double kDegree = std::numbers::pi / 180.0;

// A camera at `eye` that looks at `target`, 40 degrees high.
inline Camera LookAt(const glm::dvec3& eye, const glm::dvec3& target, int width, int height) {
  Camera camera;
  const glm::dvec3 forward = glm::normalize(target - eye);
  const glm::dvec3 up = std::abs(forward.y) > 0.99 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
  camera.view_from_world = glm::lookAt(eye, target, up);
  camera.projection = Perspective{40.0 * kDegree};
  camera.width = width;
  camera.height = height;
  camera.window = {0, 0, width, height};
  return camera;
}

inline Light Sun(const glm::dvec3& direction, float density = 1.0F) {
  Light light;
  light.kind = DirectionalLight{glm::normalize(direction)};
  light.shadow_density = glm::vec3(density);
  return light;
}

// `count` particles, evenly random in the ball of radius 1 around the origin.
inline std::shared_ptr<ParticleSet> Ball(size_t count, uint32_t seed = 1) {
  auto set = std::make_shared<ParticleSet>();
  std::mt19937 random(seed);
  // std::uniform_real_distribution may differ between libraries; this does not.
  const auto uniform = [&] { return static_cast<float>(random()) * 0x1p-31F - 1.0F; };
  while (set->size() < count) {
    const float x = uniform();
    const float y = uniform();
    const glm::vec3 p(x, y, uniform());
    if (glm::dot(p, p) <= 1.0F) set->positions.push_back(p);
  }
  return set;
}

// The ball, seen from z = 4, lit from the upper left front.
inline Scene BallScene(size_t count, int size = 96) {
  Scene scene;
  scene.particles = Ball(count);
  scene.camera = LookAt({0, 0, 4}, {0, 0, 0}, size, size);
  scene.lights = {Sun({1, -1, -0.5})};
  scene.material.radius = 0.12F;
  scene.material.opacity = 0.3F;
  scene.shadow.slices = 32;
  scene.shadow.light_buffer_size = 128;
  return scene;
}

// Gives each particle radius, colour and emission of its own, and an opacity from `least_opacity`
// up to `opacity_range` above it.
inline void VaryParticles(Scene& scene, float least_opacity, float opacity_range) {
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  for (size_t i = 0; i < set->size(); ++i) {
    const auto phase = static_cast<float>(i % 17) / 17.0F;
    set->radii.push_back(0.02F + 0.04F * phase);
    set->opacities.push_back(least_opacity + opacity_range * (1.0F - phase));
    set->colors.emplace_back(phase, 0.5F, 1.0F - phase);
    set->emissions.emplace_back(i % 29 == 0 ? 0.3F : 0.0F, 0.0F, 0.0F);
  }
  scene.particles = set;
}

inline FrameRequest Beauty(Scene scene) { return {std::move(scene), {{ImageKind::kBeauty}}}; }

}  // namespace halflight::test
