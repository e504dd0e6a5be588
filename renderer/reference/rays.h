// The rays of one eye or one light, as directions and depths.
// Knows no particles.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace halflight::reference {

// All rays from one point, or all parallel ones in one direction.
class Rays {
 public:
  static Rays From(const glm::dvec3& point) { return {false, point}; }
  // `direction` is of unit length.
  static Rays Along(const glm::dvec3& direction) { return {true, direction}; }

  // Of the ray that passes through x.
  [[nodiscard]] glm::dvec3 DirectionAt(const glm::dvec3& x) const {
    return parallel_ ? vector_ : glm::normalize(x - vector_);
  }
  // How far along its ray x lies: distance from the point, or depth along the direction.
  [[nodiscard]] double DepthOf(const glm::dvec3& x) const {
    return parallel_ ? glm::dot(x, vector_) : glm::distance(x, vector_);
  }
  // Orders points as DepthOf does, without the root, which would make ties of neighbours.
  [[nodiscard]] double NearnessOf(const glm::dvec3& x) const {
    return parallel_ ? glm::dot(x, vector_) : glm::dot(x - vector_, x - vector_);
  }

  [[nodiscard]] bool parallel() const { return parallel_; }
  // The point, or the direction.
  [[nodiscard]] const glm::dvec3& vector() const { return vector_; }

  bool operator==(const Rays&) const = default;

 private:
  Rays(bool parallel, const glm::dvec3& vector) : parallel_(parallel), vector_(vector) {}

  bool parallel_;
  glm::dvec3 vector_;
};

}  // namespace halflight::reference
