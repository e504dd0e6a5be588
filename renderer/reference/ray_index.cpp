// Enters each particle into every cell whose rays may meet it; see ray_index.h.
#include "renderer/reference/ray_index.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace halflight::reference {
namespace {

// Particles of one level differ in size by no more than this factor.
constexpr double kSizesOfLevel = 4.0;
constexpr double kMostLevels = 32.0;

// Cells in units of the particles' mean size: small cells name few particles that the ray does not
// meet, large ones keep the index of many particles small (21, 8 or 4 entries a particle).
double CellSizeFor(size_t particles) {
  if (particles <= 400'000) return 0.5;
  return particles <= 1'500'000 ? 1.0 : 2.0;
}

// Particles between two looks at whether to stop.
constexpr size_t kBetweenStops = 4096;

// How large the rays see a particle.
double SizeOf(const Particle& particle, const Rays& rays) {
  if (rays.parallel()) return particle.radius;
  return std::min(1.0, particle.radius / rays.DepthOf(particle.center));
}

// Face 0 to 5: +x, -x, +y, -y, +z, -z. Coordinates along the face's two axes and outward.
glm::dvec3 OnFace(const glm::dvec3& offset, size_t face) {
  const auto axis = static_cast<glm::length_t>(face / 2);
  const double outward = face % 2 == 0 ? offset[axis] : -offset[axis];
  return {offset[(axis + 1) % 3], offset[(axis + 2) % 3], outward};
}

struct Slopes {
  double low;
  double high;
};

// The slopes x / w, from -1 to 1, of the lines from the origin that meet a disc round (x, w).
std::optional<Slopes> SlopesOfDisc(double x, double w, double radius) {
  constexpr double kQuarter = std::numbers::pi / 4.0;
  const double square = x * x + w * w;
  if (square <= radius * radius) return Slopes{-1.0, 1.0};
  // All of the disc lies beyond the lines of slope 1 and -1.
  if (std::abs(x) - w > 1.5 * radius) return {};
  if (w > 2.0 * radius) {
    const double reach = radius * std::sqrt(square - radius * radius) * (1.0 + 1e-12);
    const double scale = 1.0 / ((w - radius) * (w + radius));
    const double low = std::max(-1.0, (x * w - reach) * scale);
    const double high = std::min(1.0, (x * w + reach) * scale);
    if (low > high) return {};
    return Slopes{low, high};
  }
  const double middle = std::atan2(x, w);
  const double half = std::asin(radius / std::sqrt(square)) * (1.0 + 1e-9) + 1e-15;
  if (middle + half < -kQuarter || middle - half > kQuarter) return {};
  return Slopes{middle - half <= -kQuarter ? -1.0 : std::tan(middle - half),
                middle + half >= kQuarter ? 1.0 : std::tan(middle + half)};
}

// What a particle covers on a face, in slopes along its two axes.
std::optional<PlaneRect> FootprintOnFace(const glm::dvec3& on_face, double radius) {
  const auto u = SlopesOfDisc(on_face.x, on_face.z, radius);
  if (!u) return {};
  const auto v = SlopesOfDisc(on_face.y, on_face.z, radius);
  if (!v) return {};
  return PlaneRect{{u->low, v->low}, {u->high, v->high}};
}

void Include(const PlaneRect& rect, PlaneRect& bounds) {
  bounds.low = glm::min(bounds.low, rect.low);
  bounds.high = glm::max(bounds.high, rect.high);
}

}  // namespace

RayIndex::RayIndex(const Rays& rays, const Cloud& cloud, std::span<const uint32_t> order,
                   const std::stop_token& stop)
    : rays_(rays) {
  if (rays_.parallel()) {
    const glm::dvec3& direction = rays_.vector();
    const glm::dvec3 helper =
        std::abs(direction.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
    axis_u_ = glm::normalize(glm::cross(direction, helper));
    axis_v_ = glm::cross(direction, axis_u_);
  }
  const std::vector<uint8_t> level_of_rank = ChooseLevels(cloud, order, stop);
  FitGrids(cloud, order, level_of_rank, stop);

  // Count the entries of each cell, then place them: by ascending rank within a cell.
  const auto for_each_entry = [&](const auto& enter) {
    for (size_t rank = 0; rank < order.size(); ++rank) {
      if (rank % kBetweenStops == 0 && stop.stop_requested()) return;
      VisitCells(cloud.particles[order[rank]], level_of_rank[rank],
                 [&](size_t cell) { enter(cell, static_cast<uint32_t>(rank)); });
    }
  };
  for_each_entry([this](size_t cell, uint32_t) { ++first_[cell + 1]; });
  for (size_t cell = 0; cell + 1 < first_.size(); ++cell) first_[cell + 1] += first_[cell];
  ranks_.resize(first_.back());
  std::vector<uint32_t> next(first_.begin(), first_.end());
  for_each_entry([this, &next](size_t cell, uint32_t rank) { ranks_[next[cell]++] = rank; });
}

std::vector<uint8_t> RayIndex::ChooseLevels(const Cloud& cloud, std::span<const uint32_t> order,
                                            const std::stop_token& stop) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const uint32_t index : order) {
    smallest = std::min(smallest, SizeOf(cloud.particles[index], rays_));
  }
  std::vector<uint8_t> level_of_rank(order.size());
  std::vector<size_t> count;
  for (size_t rank = 0; rank < order.size(); ++rank) {
    if (rank % kBetweenStops == 0 && stop.stop_requested()) break;
    const double size = SizeOf(cloud.particles[order[rank]], rays_);
    const double level = std::floor(std::log(size / smallest) / std::log(kSizesOfLevel));
    level_of_rank[rank] = static_cast<uint8_t>(std::clamp(level, 0.0, kMostLevels - 1.0));
    levels_ = std::max<size_t>(levels_, level_of_rank[rank] + 1U);
    mean_size_.resize(levels_);
    count.resize(levels_);
    mean_size_[level_of_rank[rank]] += size;
    ++count[level_of_rank[rank]];
  }
  for (size_t level = 0; level < levels_; ++level) {
    mean_size_[level] /= static_cast<double>(std::max<size_t>(count[level], 1));
  }
  return level_of_rank;
}

void RayIndex::FitGrids(const Cloud& cloud, std::span<const uint32_t> order,
                        std::span<const uint8_t> level_of_rank, const std::stop_token& stop) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<PlaneRect> bounds(levels_ * faces(), {glm::dvec2(kInfinity), glm::dvec2(-kInfinity)});
  std::vector<size_t> count(bounds.size());
  for (size_t rank = 0; rank < order.size(); ++rank) {
    if (rank % kBetweenStops == 0 && stop.stop_requested()) break;
    const Particle& particle = cloud.particles[order[rank]];
    for (size_t face = 0; face < faces(); ++face) {
      const size_t grid = level_of_rank[rank] * faces() + face;
      if (rays_.parallel()) {
        const glm::dvec2 place = PlaceOf(particle.center).on_plane;
        Include({place - particle.radius, place + particle.radius}, bounds[grid]);
      } else if (const auto footprint = FootprintOnFace(
                     OnFace(particle.center - rays_.vector(), face), particle.radius)) {
        Include(*footprint, bounds[grid]);
      } else {
        continue;
      }
      ++count[grid];
    }
  }
  size_t cells = 0;
  for (size_t grid = 0; grid < bounds.size(); ++grid) {
    grids_.push_back({{}, cells});
    if (count[grid] == 0) continue;
    // Eight cells a particle are as many as the smallest cells come to where particles do not
    // overlap; beyond them most would be empty.
    grids_.back().cells = CellGrid(
        bounds[grid], CellSizeFor(order.size()) * mean_size_[grid / faces()], 64 + 8 * count[grid]);
    cells += grids_.back().cells.size();
  }
  first_.assign(cells + 1, 0);
}

template <typename Enter>
void RayIndex::VisitCells(const Particle& particle, uint8_t level, const Enter& enter) const {
  for (size_t face = 0; face < faces(); ++face) {
    const Grid& grid = grids_[level * faces() + face];
    if (grid.cells.size() == 0) continue;
    if (rays_.parallel()) {
      VisitCellsOfPlane(particle, grid, enter);
    } else {
      VisitCellsOfFace(particle, face, grid, enter);
    }
  }
}

template <typename Enter>
void RayIndex::VisitCellsOfPlane(const Particle& particle, const Grid& grid,
                                 const Enter& enter) const {
  const CellGrid& cells = grid.cells;
  const glm::dvec2 place = PlaceOf(particle.center).on_plane;
  const double radius = particle.radius * (1.0 + 1e-9) + 1e-9 * cells.cell_size();
  const int last_row = cells.RowAt(place.y + radius);
  for (int row = cells.RowAt(place.y - radius); row <= last_row; ++row) {
    // The widest part of the disc within the row.
    const double away =
        std::max(0.0, std::abs(cells.CenterOf(0, row).y - place.y) - 0.5 * cells.cell_size());
    const double half =
        std::sqrt(std::max(0.0, (radius - away) * (radius + away))) + 1e-9 * cells.cell_size();
    const int last_column = cells.ColumnAt(place.x + half);
    for (int column = cells.ColumnAt(place.x - half); column <= last_column; ++column) {
      enter(grid.first_cell + cells.CellAt(column, row));
    }
  }
}

template <typename Enter>
void RayIndex::VisitCellsOfFace(const Particle& particle, size_t face, const Grid& grid,
                                const Enter& enter) const {
  const CellGrid& cells = grid.cells;
  const glm::dvec3 offset = OnFace(particle.center - rays_.vector(), face);
  const auto footprint = FootprintOnFace(offset, particle.radius);
  if (!footprint) return;
  // Rays of a cell deviate from the one through its centre by no more than half its diagonal, so
  // they pass the particle's centre no nearer than that one does less this much.
  const double half_diagonal = std::sqrt(0.5) * cells.cell_size();
  const double reach = (particle.radius + half_diagonal * glm::length(offset)) * (1.0 + 1e-9);
  const double slack = 1e-9 * cells.cell_size();
  const int last_row = cells.RowAt(footprint->high.y + slack);
  const int last_column = cells.ColumnAt(footprint->high.x + slack);
  for (int row = cells.RowAt(footprint->low.y - slack); row <= last_row; ++row) {
    for (int column = cells.ColumnAt(footprint->low.x - slack); column <= last_column; ++column) {
      const glm::dvec3 ray(cells.CenterOf(column, row), 1.0);
      const glm::dvec3 across = glm::cross(offset, ray);
      if (glm::dot(across, across) > reach * reach * glm::dot(ray, ray)) continue;
      enter(grid.first_cell + cells.CellAt(column, row));
    }
  }
}

RayIndex::Place RayIndex::PlaceOf(const glm::dvec3& x) const {
  if (rays_.parallel()) return {0, {glm::dot(x, axis_u_), glm::dot(x, axis_v_)}};
  const glm::dvec3 offset = x - rays_.vector();
  const glm::dvec3 size = glm::abs(offset);
  const glm::length_t axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const size_t face = 2 * static_cast<size_t>(axis) + (offset[axis] < 0.0 ? 1 : 0);
  const glm::dvec3 on_face = OnFace(offset, face);
  const double scale = on_face.z > 0.0 ? 1.0 / on_face.z : 0.0;
  return {face, scale * glm::dvec2(on_face)};
}

}  // namespace halflight::reference
