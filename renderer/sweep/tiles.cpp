#include "renderer/sweep/tiles.h"

#include <algorithm>
#include <numeric>

#include "renderer/parallel.h"

namespace halflight::sweep {

namespace {

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

TileLists ListTiles(std::span<const Rect> rects, const glm::ivec2& target_size, int tile_size) {
  TileLists lists;
  lists.tile_size = tile_size;
  lists.tiles = (target_size + (tile_size - 1)) / tile_size;
  const auto tile_count = static_cast<size_t>(lists.tiles.x) * lists.tiles.y;
  const size_t workers = WorkerCount(rects.size());

  // Count: of each worker's range of items, the entries of every tile.
  std::vector<std::vector<uint32_t>> counts(workers);
  ParallelRanges(rects.size(), [&](const WorkRange& range) {
    std::vector<uint32_t> count(tile_count, 0);
    for (size_t i = range.begin; i < range.end; ++i) {
      ForTilesOf(rects[i], tile_size, lists.tiles.x, [&](size_t tile) { ++count[tile]; });
    }
    counts[range.worker] = std::move(count);
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
  ParallelRanges(rects.size(), [&](const WorkRange& range) {
    std::vector<size_t>& next = at[range.worker];
    for (size_t i = range.begin; i < range.end; ++i) {
      ForTilesOf(rects[i], tile_size, lists.tiles.x,
                 [&](size_t tile) { lists.entries[next[tile]++] = static_cast<uint32_t>(i); });
    }
  });
  return lists;
}

std::vector<TileRun> CutIntoRuns(std::span<const Rect> rects, int tile_size,
                                 const RunLimits& limits) {
  std::vector<TileRun> runs;
  size_t entries = 0;
  for (size_t i = 0; i < rects.size(); ++i) {
    const size_t more = TilesOf(rects[i], tile_size).count();
    if (runs.empty() || runs.back().size() == limits.rects || entries + more > limits.entries) {
      runs.push_back({i, i});
      entries = 0;
    }
    runs.back().end = i + 1;
    entries += more;
  }
  return runs;
}

}  // namespace halflight::sweep
