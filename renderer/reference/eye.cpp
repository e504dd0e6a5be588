#include "renderer/reference/eye.h"

#include <cmath>

#include <glm/matrix.hpp>

namespace halflight::reference {
namespace {

glm::dvec3 OriginOf(const Scene& scene) {
  return scene.particles == nullptr ? glm::dvec3(0.0) : scene.particles->origin;
}

}  // namespace

Eye::Eye(const Scene& scene)
    : world_from_view_(glm::transpose(glm::dmat3(scene.camera.view_from_world))),
      position_(-(world_from_view_ * glm::dvec3(scene.camera.view_from_world[3])) -
                OriginOf(scene)),
      forward_(glm::normalize(world_from_view_ * glm::dvec3(0.0, 0.0, -1.0))),
      orthographic_(std::holds_alternative<Orthographic>(scene.camera.projection)),
      half_height_(
          orthographic_
              ? std::get<Orthographic>(scene.camera.projection).height / 2.0
              : std::tan(std::get<Perspective>(scene.camera.projection).vertical_fov / 2.0)),
      width_(scene.camera.width),
      height_(scene.camera.height) {}

EyeRay Eye::RayThrough(double x, double y) const {
  const double right = (2.0 * x - width_) / height_ * half_height_;
  const double up = (height_ - 2.0 * y) / height_ * half_height_;
  if (orthographic_) {
    return {position_ + world_from_view_ * glm::dvec3(right, up, 0.0), forward_};
  }
  return {position_, glm::normalize(world_from_view_ * glm::dvec3(right, up, -1.0))};
}

Rays RaysOf(const Light& light, const Scene& scene) {
  if (const auto* sun = std::get_if<DirectionalLight>(&light.kind)) {
    return Rays::Along(sun->direction);
  }
  return Rays::From(std::get<PointLight>(light.kind).position - OriginOf(scene));
}

}  // namespace halflight::reference
