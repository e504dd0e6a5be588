// Which particles touch which tile of a target, in order; and how many of them are listed at once.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "renderer/block_cache.h"

namespace halflight::sweep {

// Pixels [x_begin, x_end) by [y_begin, y_end) of a target; empty where a particle is not seen.
struct Rect {
  uint16_t x_begin = 0;
  uint16_t x_end = 0;
  uint16_t y_begin = 0;
  uint16_t y_end = 0;

  [[nodiscard]] bool empty() const { return x_begin >= x_end; }
};

// Largest side of a target that rectangles reach across.
inline constexpr int kMaxTargetSide = 65535;

// Tiles [x_begin, x_end) by [y_begin, y_end).
struct TileRange {
  int x_begin = 0;
  int x_end = 0;
  int y_begin = 0;
  int y_end = 0;

  [[nodiscard]] size_t count() const {
    return static_cast<size_t>(x_end - x_begin) * static_cast<size_t>(y_end - y_begin);
  }
};

// Those that a rectangle touches; tile sizes are powers of two.
inline TileRange TilesOf(const Rect& rect, int tile_size) {
  if (rect.empty()) return {};
  const int shift = std::countr_zero(static_cast<unsigned>(tile_size));
  return {rect.x_begin >> shift, ((rect.x_end - 1) >> shift) + 1, rect.y_begin >> shift,
          ((rect.y_end - 1) >> shift) + 1};
}

struct TileLists {
  glm::ivec2 tiles{0};
  int tile_size = 0;  // pixels along each side
  // Tile t (row by row) has entries [begin[t], begin[t + 1]): indices of the rectangles that touch
  // it, ascending.
  std::vector<size_t> begin;
  Block<uint32_t> entries;

  [[nodiscard]] size_t bytes() const {
    return begin.capacity() * sizeof(size_t) + entries.capacity() * sizeof(uint32_t);
  }
};

// The tiles, those with the most entries first: where there are few, the cores end together.
std::vector<uint32_t> LongestFirst(const TileLists& lists);

// Uses all cores. Targets of at most kMaxTargetSide pixels along a side.
TileLists ListTiles(std::span<const Rect> rects, const glm::ivec2& target_size, int tile_size);

// Consecutive rectangles whose tiles are listed at once.
struct TileRun {
  size_t begin = 0;
  size_t end = 0;

  [[nodiscard]] size_t size() const { return end - begin; }
};

struct RunLimits {
  size_t rects = 1U << 18U;
  size_t entries = 1U << 22U;  // exceeded only by a single rectangle
};

// Cuts rectangles into the fewest runs within the limits, in order; none for none.
std::vector<TileRun> CutIntoRuns(std::span<const Rect> rects, int tile_size,
                                 const RunLimits& limits);

}  // namespace halflight::sweep
