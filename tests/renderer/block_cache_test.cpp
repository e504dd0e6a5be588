// Blocks between frames: what is given back is handed out again, within its bounds.
#include "renderer/block_cache.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>

namespace halflight {
namespace {

constexpr size_t kMebi = size_t{1} << 20U;

// Of a block that is given back at once.
uintptr_t PlaceOf(size_t bytes) {
  const Block<char> block(bytes);
  const auto place = reinterpret_cast<uintptr_t>(block.data());
  return place;
}

class BlockCacheOf : public testing::Test {
 protected:
  BlockCacheOf() { BlockCache::Release(); }
  ~BlockCacheOf() override {
    BlockCache::SetLimit(1024 * kMebi);
    BlockCache::Release();
  }
};

TEST_F(BlockCacheOf, OneBlockHandsItOutAgain) {
  const uintptr_t first = PlaceOf(4 * kMebi);
  EXPECT_GE(BlockCache::idle_bytes(), 4 * kMebi);
  const Block<uint32_t> second(kMebi);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(second.data()), first);
  EXPECT_EQ(BlockCache::idle_bytes(), 0U);
}

TEST_F(BlockCacheOf, OtherSizesDoesNotMixThem) {
  const uintptr_t small = PlaceOf(4 * kMebi);
  EXPECT_NE(PlaceOf(12 * kMebi), small);
  EXPECT_GE(BlockCache::idle_bytes(), 4 * kMebi);
}

TEST_F(BlockCacheOf, SmallArraysLeavesThemToTheHeap) {
  { const Block<char> block(BlockCache::kLeastBytes - 1); }
  EXPECT_EQ(BlockCache::idle_bytes(), 0U);
  { const Block<char> block(BlockCache::kLeastBytes); }
  EXPECT_EQ(BlockCache::idle_bytes(), BlockCache::kLeastBytes);
}

TEST_F(BlockCacheOf, MoreThanItsLimitLetsGoOfWhatWasIdleLongest) {
  BlockCache::SetLimit(3 * kMebi);
  uintptr_t newest = 0;
  {
    const Block<char> a(kMebi);
    const Block<char> b(kMebi);
    const Block<char> c(kMebi);
    const Block<char> d(kMebi);
    newest = reinterpret_cast<uintptr_t>(a.data());  // destroyed last
  }
  EXPECT_EQ(BlockCache::idle_bytes(), 3 * kMebi);
  EXPECT_EQ(PlaceOf(kMebi), newest);
  { const Block<char> too_large(4 * kMebi); }
  EXPECT_EQ(BlockCache::idle_bytes(), 0U);
}

TEST_F(BlockCacheOf, AnySizeIsAligned) {
  for (size_t bytes = BlockCache::kLeastBytes; bytes < 20 * kMebi; bytes = bytes * 3 / 2 + 1) {
    Block<char> block(bytes);
    block.front() = block.back() = 1;
    EXPECT_EQ(reinterpret_cast<uintptr_t>(block.data()) % 64, 0U) << bytes;
  }
}

TEST_F(BlockCacheOf, SeveralThreadsKeepsTheirBlocksApart) {
  const auto work = [](uint32_t mark) {
    for (int i = 0; i < 200; ++i) {
      Block<uint32_t> block;
      block.assign(kMebi / 4, mark);
      for (const uint32_t value : block) ASSERT_EQ(value, mark);
    }
  };
  std::jthread a(work, 1U);
  std::jthread b(work, 2U);
  work(3U);
}

}  // namespace
}  // namespace halflight
