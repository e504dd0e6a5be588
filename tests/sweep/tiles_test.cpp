// Tile lists against a search of every rectangle, and runs against their limits.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "renderer/sweep/tiles.h"

namespace halflight::sweep {
namespace {

Block<Rect> RandomRects(size_t count, const glm::ivec2& size) {
  std::mt19937 random(7);
  Block<Rect> rects(count);
  for (Rect& rect : rects) {
    const auto x = static_cast<int>(random() % static_cast<unsigned>(size.x));
    const auto y = static_cast<int>(random() % static_cast<unsigned>(size.y));
    if (random() % 10 == 0) continue;  // not seen
    rect = {static_cast<uint16_t>(x),
            static_cast<uint16_t>(std::min<int>(size.x, x + 1 + static_cast<int>(random() % 30))),
            static_cast<uint16_t>(y),
            static_cast<uint16_t>(std::min<int>(size.y, y + 1 + static_cast<int>(random() % 30)))};
  }
  return rects;
}

// More than one core's share, and targets that are no multiple of a tile.
TEST(ListTiles, HasEveryTouchedTileOnceInOrder) {
  const glm::ivec2 size(101, 67);
  constexpr int kTile = 8;
  const Block<Rect> rects = RandomRects(40000, size);
  const TileLists lists = ListTiles(rects, size, kTile);
  ASSERT_EQ(lists.tiles, glm::ivec2(13, 9));
  for (int tile = 0; tile < 13 * 9; ++tile) {
    const int x = tile % 13 * kTile;
    const int y = tile / 13 * kTile;
    size_t entry = lists.begin[static_cast<size_t>(tile)];
    for (size_t i = 0; i < rects.size(); ++i) {
      const Rect& rect = rects[i];
      if (rect.empty() || rect.x_begin >= x + kTile || rect.x_end <= x ||
          rect.y_begin >= y + kTile || rect.y_end <= y) {
        continue;
      }
      ASSERT_LT(entry, lists.begin[static_cast<size_t>(tile) + 1]);
      ASSERT_EQ(lists.entries[entry], i);
      ++entry;
    }
    ASSERT_EQ(entry, lists.begin[static_cast<size_t>(tile) + 1]);
  }
}

// Every rectangle once, in order; no run could have been joined by the next one's first.
TEST(CutIntoRuns, KeepsWithinTheLimitsWithAsFewAsCanBe) {
  const Block<Rect> rects = RandomRects(5000, {101, 67});
  for (const RunLimits limits : {RunLimits{100, 1000}, RunLimits{5000, 300}, RunLimits{64, 100000},
                                 RunLimits{5000, 100000}, RunLimits{10, 1}}) {
    const std::vector<TileRun> runs = CutIntoRuns(rects, 8, limits);
    size_t next = 0;
    for (const TileRun& run : runs) {
      ASSERT_EQ(run.begin, next);
      ASSERT_GT(run.end, run.begin);
      next = run.end;
      size_t entries = 0;
      for (size_t i = run.begin; i < run.end; ++i) entries += TilesOf(rects[i], 8).count();
      EXPECT_LE(run.size(), limits.rects);
      EXPECT_TRUE(run.size() == 1 || entries <= limits.entries);
      if (run.end == rects.size()) continue;
      EXPECT_TRUE(run.size() == limits.rects ||
                  entries + TilesOf(rects[run.end], 8).count() > limits.entries);
    }
    EXPECT_EQ(next, rects.size());
  }
  EXPECT_TRUE(CutIntoRuns({}, 8, {}).empty());
}

TEST(ListTiles, OfNothingIsEmpty) {
  const TileLists lists = ListTiles({}, {20, 20}, 8);
  EXPECT_TRUE(lists.entries.empty());
  EXPECT_EQ(lists.begin.size(), 10U);
}

}  // namespace
}  // namespace halflight::sweep
