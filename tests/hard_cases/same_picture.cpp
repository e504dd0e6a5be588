#include "tests/hard_cases/same_picture.h"

#include <cmath>
#include <memory>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

namespace halflight::test {
namespace {

std::shared_ptr<ParticleSet> CopyOf(const Scene& scene) {
  return std::make_shared<ParticleSet>(*scene.particles);
}

PointLight* PointOf(Light& light) { return std::get_if<PointLight>(&light.kind); }

}  // namespace

Scene Moved(Scene scene, const glm::dvec3& by) {
  auto set = CopyOf(scene);
  set->origin += by;
  scene.particles = set;
  scene.camera.view_from_world = glm::translate(scene.camera.view_from_world, -by);
  for (Light& light : scene.lights) {
    if (PointLight* point = PointOf(light)) point->position += by;
  }
  return scene;
}

Scene Scaled(Scene scene, double factor) {
  const auto by = static_cast<float>(factor);
  auto set = CopyOf(scene);
  set->origin *= factor;
  for (glm::vec3& position : set->positions) position *= by;
  for (glm::vec3& velocity : set->velocities) velocity *= by;
  for (float& radius : set->radii) radius *= by;
  scene.particles = set;
  scene.material.radius *= by;
  // Variance grows with the distance.
  scene.material.scattering_spread *= std::sqrt(by);
  glm::dmat4& view = scene.camera.view_from_world;
  view[3] = glm::dvec4(glm::dvec3(view[3]) * factor, 1.0);
  if (auto* flat = std::get_if<Orthographic>(&scene.camera.projection)) flat->height *= factor;
  for (Light& light : scene.lights) {
    PointLight* point = PointOf(light);
    if (point == nullptr) continue;
    point->position *= factor;
    if (point->inverse_square_falloff) light.color *= by * by;
  }
  return scene;
}

Scene Turned(Scene scene, const glm::dmat3& rotation) {
  auto set = CopyOf(scene);
  set->origin = rotation * set->origin;
  for (glm::vec3& position : set->positions) position = rotation * glm::dvec3(position);
  for (glm::vec3& velocity : set->velocities) velocity = rotation * glm::dvec3(velocity);
  scene.particles = set;
  scene.camera.view_from_world =
      scene.camera.view_from_world * glm::dmat4(glm::transpose(rotation));
  for (Light& light : scene.lights) {
    if (PointLight* point = PointOf(light)) {
      point->position = rotation * point->position;
    } else {
      auto& sun = std::get<DirectionalLight>(light.kind);
      sun.direction = glm::normalize(rotation * sun.direction);
    }
  }
  return scene;
}

Scene WithOwnAttributes(Scene scene) {
  auto set = CopyOf(scene);
  const size_t count = set->size();
  if (set->radii.empty()) set->radii.assign(count, scene.material.radius);
  if (set->opacities.empty()) set->opacities.assign(count, scene.material.opacity);
  if (set->colors.empty()) set->colors.assign(count, glm::vec3(1.0F));
  if (set->emissions.empty()) set->emissions.assign(count, scene.material.emission);
  if (set->velocities.empty()) set->velocities.assign(count, glm::vec3(0.0F));
  scene.particles = set;
  return scene;
}

}  // namespace halflight::test
