// Which particles the rays of one eye or one light may meet, found without trying all of them.
// Only narrows the search, always on the safe side: whether a ray does meet a particle, and where,
// is for the caller to work out.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "tests/oracle/cloud.h"

namespace halflight::oracle {

// All rays from one point, or all parallel ones in one direction.
class Rays {
 public:
  static Rays From(const glm::dvec3& point) { return {false, point}; }
  // `direction` is of unit length.
  static Rays Along(const glm::dvec3& direction) { return {true, direction}; }

  // Of the ray that passes through x.
  [[nodiscard]] glm::dvec3 DirectionAt(const glm::dvec3& x) const;
  // How far along its ray x lies: distance from the point, or depth along the direction.
  [[nodiscard]] double DepthOf(const glm::dvec3& x) const;

  [[nodiscard]] bool parallel() const { return parallel_; }
  // The point, or the direction.
  [[nodiscard]] const glm::dvec3& vector() const { return vector_; }

 private:
  Rays(bool parallel, const glm::dvec3& vector) : parallel_(parallel), vector_(vector) {}

  bool parallel_;
  glm::dvec3 vector_;
};

// Cells of a square grid across parallel rays, or of the six faces of a cube round a point.
class RayIndex {
 public:
  // Candidates come in the order of `order`, which names particles of `cloud` once each.
  RayIndex(const Rays& rays, const Cloud& cloud, std::span<const uint32_t> order);

  // Positions in `order`, ascending, of all particles that the ray through x may meet.
  [[nodiscard]] std::span<const uint32_t> Candidates(const glm::dvec3& x) const;

  [[nodiscard]] const Rays& rays() const { return rays_; }

 private:
  struct Entry {
    uint32_t cell;
    uint32_t rank;
  };

  void EnterParallel(const Cloud& cloud, std::span<const uint32_t> order,
                     std::vector<Entry>& entries);
  void EnterCube(const Cloud& cloud, std::span<const uint32_t> order, std::vector<Entry>& entries);
  [[nodiscard]] int64_t CellOf(const glm::dvec3& x) const;  // -1: outside

  Rays rays_;
  glm::dvec3 axis_u_{0.0};  // of the plane across parallel rays
  glm::dvec3 axis_v_{0.0};
  double low_u_ = 0.0;
  double low_v_ = 0.0;
  double cell_size_ = 1.0;
  int columns_ = 0;  // of a cube's face: its cells along each side
  int rows_ = 0;
  std::vector<uint32_t> first_;  // of each cell in ranks_, and one more
  std::vector<uint32_t> ranks_;
};

}  // namespace halflight::oracle
