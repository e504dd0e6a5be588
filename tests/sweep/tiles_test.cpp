// Tile lists against a search of every rectangle.
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
  std::vector<uint32_t> parts_of(rects.size(), 0);
  std::vector<bool> part_seen(lists.entries.size(), false);
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
      ASSERT_EQ(lists.entries[entry].item, i);
      const uint32_t part = lists.entries[entry].part;
      EXPECT_GE(part, lists.part_begin[i]);
      EXPECT_LT(part, lists.part_begin[i + 1]);
      EXPECT_FALSE(part_seen[part]);
      part_seen[part] = true;
      ++parts_of[i];
      ++entry;
    }
    ASSERT_EQ(entry, lists.begin[static_cast<size_t>(tile) + 1]);
  }
  for (size_t i = 0; i < rects.size(); ++i) {
    ASSERT_EQ(parts_of[i], lists.part_begin[i + 1] - lists.part_begin[i]);
  }
}

TEST(ListTiles, OfNothingIsEmpty) {
  const TileLists lists = ListTiles({}, {20, 20}, 8);
  EXPECT_TRUE(lists.entries.empty());
  EXPECT_EQ(lists.begin.size(), 10U);
}

}  // namespace
}  // namespace halflight::sweep
