#include "renderer/reference/cell_grid.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

namespace halflight::reference {

CellGrid::CellGrid(const PlaneRect& bounds, double wanted_cell_size, size_t most_cells) {
  // A margin for what rounding does to places at the very edge.
  const glm::dvec2 margin =
      1e-9 * (bounds.high - bounds.low) + 1e-12 * (glm::abs(bounds.low) + glm::abs(bounds.high));
  low_ = bounds.low - margin;
  const glm::dvec2 extent = bounds.high + margin - low_;
  const auto most = static_cast<double>(most_cells);
  // The second keeps a strip, one cell wide, within the limit.
  cell_size_ = std::max({wanted_cell_size, std::sqrt(extent.x * extent.y / most),
                         std::max(extent.x, extent.y) / most});
  columns_ = static_cast<int>(extent.x / cell_size_) + 1;
  rows_ = static_cast<int>(extent.y / cell_size_) + 1;
}

std::optional<size_t> CellGrid::CellAt(const glm::dvec2& place) const {
  const glm::dvec2 cell = (place - low_) / cell_size_;
  if (!(cell.x >= 0.0 && cell.y >= 0.0 && cell.x < columns_ && cell.y < rows_)) return {};
  return CellAt(static_cast<int>(cell.x), static_cast<int>(cell.y));
}

int CellGrid::Nearest(double place, int count) {
  return static_cast<int>(std::clamp(std::floor(place), 0.0, count - 1.0));
}

}  // namespace halflight::reference
