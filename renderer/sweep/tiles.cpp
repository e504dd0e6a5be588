#include "renderer/sweep/tiles.h"

#include <algorithm>
#include <numeric>

#include "renderer/parallel.h"

namespace halflight::sweep {

namespace {

struct TileRange {
  int x_begin, x_end, y_begin, y_end;

  [[nodiscard]] uint32_t count() const {
    return static_cast<uint32_t>((x_end - x_begin) * (y_end - y_begin));
  }
};

TileRange TilesOf(const Rect& rect, int tile_size) {
  if (rect.empty()) return {0, 0, 0, 0};
  return {rect.x_begin / tile_size, (rect.x_end - 1) / tile_size + 1, rect.y_begin / tile_size,
          (rect.y_end - 1) / tile_size + 1};
}

template <typename Visit>
void ForTilesOf(const Rect& rect, int tile_size, int tiles_across, const Visit& visit) {
  const TileRange range = TilesOf(rect, tile_size);
  for (int y = range.y_begin; y < range.y_end; ++y) {
    for (int x = range.x_begin; x < range.x_end; ++x) {
      visit(static_cast<size_t>(y) * tiles_across + x);
    }
  }
}

}  // namespace

std::vector<uint32_t> LongestFirst(const TileLists& lists) {
  std::vector<uint32_t> tiles(lists.begin.size() - 1);
  std::iota(tiles.begin(), tiles.end(), 0U);
  const auto length = [&](uint32_t tile) { return lists.begin[tile + 1] - lists.begin[tile]; };
  std::stable_sort(tiles.begin(), tiles.end(),
                   [&](uint32_t a, uint32_t b) { return length(a) > length(b); });
  return tiles;
}

TileLists ListTiles(const Block<Rect>& rects, const glm::ivec2& target_size, int tile_size) {
  TileLists lists;
  lists.tiles = (target_size + (tile_size - 1)) / tile_size;
  const auto tile_count = static_cast<size_t>(lists.tiles.x) * lists.tiles.y;
  const size_t workers = WorkerCount(rects.size());

  // Count: of each worker's range of items, the entries of every tile.
  std::vector<std::vector<uint32_t>> counts(workers);
  std::vector<uint32_t> parts(workers, 0);
  ParallelRanges(rects.size(), [&](const WorkRange& range) {
    std::vector<uint32_t> count(tile_count, 0);
    uint32_t entries = 0;
    for (size_t i = range.begin; i < range.end; ++i) {
      ForTilesOf(rects[i], tile_size, lists.tiles.x, [&](size_t tile) { ++count[tile]; });
      entries += TilesOf(rects[i], tile_size).count();
    }
    counts[range.worker] = std::move(count);
    parts[range.worker] = entries;
  });

  // Sum: where each worker's entries of each tile begin, earlier items first.
  lists.begin.resize(tile_count + 1, 0);
  std::vector<std::vector<size_t>> at(workers, std::vector<size_t>(tile_count, 0));
  size_t total = 0;
  for (size_t tile = 0; tile < tile_count; ++tile) {
    lists.begin[tile] = total;
    for (size_t worker = 0; worker < workers; ++worker) {
      at[worker][tile] = total;
      if (!counts[worker].empty()) total += counts[worker][tile];
    }
  }
  lists.begin[tile_count] = total;

  // Scatter.
  lists.entries.resize(total);
  lists.part_begin.resize(rects.size() + 1);
  ParallelRanges(rects.size(), [&](const WorkRange& range) {
    uint32_t part = 0;
    for (size_t worker = 0; worker < range.worker; ++worker) part += parts[worker];
    std::vector<size_t>& next = at[range.worker];
    for (size_t i = range.begin; i < range.end; ++i) {
      lists.part_begin[i] = part;
      ForTilesOf(rects[i], tile_size, lists.tiles.x, [&](size_t tile) {
        lists.entries[next[tile]++] = {static_cast<uint32_t>(i), part++};
      });
    }
  });
  lists.part_begin[rects.size()] = static_cast<uint32_t>(total);
  return lists;
}

}  // namespace halflight::sweep
