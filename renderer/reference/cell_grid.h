// A rectangle of a plane, cut into square cells.
// Only finds cells: holds nothing in them.
#pragma once

#include <cstddef>
#include <optional>

#include <glm/vec2.hpp>

namespace halflight::reference {

struct PlaneRect {
  glm::dvec2 low;
  glm::dvec2 high;
};

class CellGrid {
 public:
  CellGrid() = default;  // no cells
  // Cells of the wanted size, or larger ones where these would be more than `most_cells`.
  CellGrid(const PlaneRect& bounds, double wanted_cell_size, size_t most_cells);

  [[nodiscard]] size_t size() const {
    return static_cast<size_t>(columns_) * static_cast<size_t>(rows_);
  }
  [[nodiscard]] double cell_size() const { return cell_size_; }
  [[nodiscard]] glm::dvec2 CenterOf(int column, int row) const {
    return low_ + cell_size_ * glm::dvec2(column + 0.5, row + 0.5);
  }

  // None outside the grid.
  [[nodiscard]] std::optional<size_t> CellAt(const glm::dvec2& place) const;
  [[nodiscard]] size_t CellAt(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
  }
  // The nearest column or row of the grid.
  [[nodiscard]] int ColumnAt(double x) const {
    return Nearest((x - low_.x) / cell_size_, columns_);
  }
  [[nodiscard]] int RowAt(double y) const { return Nearest((y - low_.y) / cell_size_, rows_); }

 private:
  static int Nearest(double place, int count);

  glm::dvec2 low_{0.0};
  double cell_size_ = 1.0;
  int columns_ = 0;
  int rows_ = 0;
};

}  // namespace halflight::reference
