// Which particles touch which tile of a target, in order.
#pragma once

#include <cstddef>
#include <cstdint>
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

// One entry for each tile that a rectangle touches.
struct TileEntry {
  uint32_t item;  // whose rectangle
  uint32_t part;  // counts the entries in the order of items
};

struct TileLists {
  glm::ivec2 tiles{0};
  // Tile t (row by row) has entries [begin[t], begin[t + 1]), by ascending item.
  std::vector<size_t> begin;
  Block<TileEntry> entries;
  // Item i has the parts [part_begin[i], part_begin[i + 1]).
  Block<uint32_t> part_begin;
};

// The tiles, those with the most entries first: where there are few, the cores end together.
std::vector<uint32_t> LongestFirst(const TileLists& lists);

// Uses all cores. Targets of at most 65535 pixels along a side.
TileLists ListTiles(const Block<Rect>& rects, const glm::ivec2& target_size, int tile_size);

}  // namespace halflight::sweep
