// The camera's rays, from the particle set's origin as all places of the reference.
// Knows no particles.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "renderer/reference/rays.h"
#include "renderer/scene.h"

namespace halflight::reference {

struct EyeRay {
  glm::dvec3 origin;
  glm::dvec3 direction;  // unit length
};

class Eye {
 public:
  explicit Eye(const Scene& scene);

  // Through a place in the whole image, in pixels from its top left corner.
  [[nodiscard]] EyeRay RayThrough(double x, double y) const;
  // Along the camera's axis.
  [[nodiscard]] double DepthOf(const glm::dvec3& x) const {
    return glm::dot(x - position_, forward_);
  }

  [[nodiscard]] Rays rays() const {
    return orthographic_ ? Rays::Along(forward_) : Rays::From(position_);
  }
  [[nodiscard]] const glm::dvec3& position() const { return position_; }
  [[nodiscard]] const glm::dvec3& forward() const { return forward_; }  // unit length

 private:
  glm::dmat3 world_from_view_;
  glm::dvec3 position_;
  glm::dvec3 forward_;
  bool orthographic_;
  double half_height_;  // of the image: at depth 1, or in world units if orthographic
  double width_;        // pixels
  double height_;
};

// Of a light, from the set's origin.
Rays RaysOf(const Light& light, const Scene& scene);

}  // namespace halflight::reference
