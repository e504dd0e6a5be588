// Which particles the rays of one eye or one light may meet, found without trying all of them.
// Only narrows the search, always on the safe side: whether a ray does meet a particle, and where,
// is for the caller to work out.
#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/reference/cell_grid.h"
#include "renderer/reference/cloud.h"
#include "renderer/reference/rays.h"

namespace halflight::reference {

// Grids across parallel rays, or on the six faces of a cube round a point. Particles of different
// size, as the rays see them, lie in grids of different cells (levels), each fitted to its own
// particles, so that neither a few large ones nor a distant cloud cost more than others.
class RayIndex {
 public:
  // `order` names particles of `cloud` once each. Soon after `stop` was requested: an index of some
  // particles only.
  RayIndex(const Rays& rays, const Cloud& cloud, std::span<const uint32_t> order,
           const std::stop_token& stop);

  // Calls visit(begin, end) for ranges of ranks() which together name all particles that the ray
  // through x may meet, once each; each range ascending.
  template <typename Visit>
  void VisitCandidates(const glm::dvec3& x, const Visit& visit) const {
    const Place place = PlaceOf(x);
    for (size_t level = 0; level < levels_; ++level) {
      const Grid& grid = grids_[level * faces() + place.face];
      if (const auto cell = grid.cells.CellAt(place.on_plane)) {
        visit(first_[grid.first_cell + *cell], first_[grid.first_cell + *cell + 1]);
      }
    }
  }

  [[nodiscard]] size_t bytes() const {
    return grids_.size() * sizeof(Grid) + (first_.size() + ranks_.size()) * sizeof(uint32_t);
  }
  // Positions in `order`, of each cell's particles after the other's.
  [[nodiscard]] const std::vector<uint32_t>& ranks() const { return ranks_; }
  [[nodiscard]] const Rays& rays() const { return rays_; }
  // Across parallel rays.
  [[nodiscard]] const glm::dvec3& axis_u() const { return axis_u_; }
  [[nodiscard]] const glm::dvec3& axis_v() const { return axis_v_; }

 private:
  struct Place {
    size_t face;
    glm::dvec2 on_plane;
  };
  struct Grid {
    CellGrid cells;
    size_t first_cell = 0;  // in first_
  };

  [[nodiscard]] size_t faces() const { return rays_.parallel() ? 1 : 6; }
  [[nodiscard]] Place PlaceOf(const glm::dvec3& x) const;
  [[nodiscard]] std::vector<uint8_t> ChooseLevels(const Cloud& cloud,
                                                  std::span<const uint32_t> order,
                                                  const std::stop_token& stop);
  void FitGrids(const Cloud& cloud, std::span<const uint32_t> order,
                std::span<const uint8_t> level_of_rank, const std::stop_token& stop);
  // Calls enter(cell) for every cell whose rays may meet the particle.
  template <typename Enter>
  void VisitCells(const Particle& particle, uint8_t level, const Enter& enter) const;
  template <typename Enter>
  void VisitCellsOfPlane(const Particle& particle, const Grid& grid, const Enter& enter) const;
  template <typename Enter>
  void VisitCellsOfFace(const Particle& particle, size_t face, const Grid& grid,
                        const Enter& enter) const;

  Rays rays_;
  glm::dvec3 axis_u_{0.0};
  glm::dvec3 axis_v_{0.0};
  size_t levels_ = 0;
  std::vector<double> mean_size_;  // by level: radius, or its ratio to the distance
  std::vector<Grid> grids_;        // by level, then face
  std::vector<uint32_t> first_;    // of each cell in ranks_, and one more
  std::vector<uint32_t> ranks_;
};

}  // namespace halflight::reference
