// The order of particles: keys and the radix sort.
#include "renderer/sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

namespace halflight {
namespace {

TEST(OrderedKey, OrdersAsFloatsDo) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float denormal = std::numeric_limits<float>::denorm_min();
  const std::vector<float> ascending = {-infinity, -1e30F,   -2.0F, -1.0F, -denormal,
                                        0.0F,      denormal, 1.0F,  2.0F,  infinity};
  for (size_t i = 1; i < ascending.size(); ++i) {
    EXPECT_LT(OrderedKey(ascending[i - 1]), OrderedKey(ascending[i])) << ascending[i];
  }
}

TEST(OrderedKey, TakesNegativeZeroAsZero) { EXPECT_EQ(OrderedKey(-0.0F), OrderedKey(0.0F)); }

std::vector<uint32_t> StableOrder(const std::vector<uint32_t>& keys) {
  std::vector<uint32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
  return order;
}

class SortedOrderOf : public testing::TestWithParam<size_t> {};

TEST_P(SortedOrderOf, IsTheStableSortOfItsKeys) {
  // Few distinct keys in half of the cases, so that stability shows; sizes on both sides of what
  // goes to several threads.
  for (const uint32_t distinct : {7U, 0xFFFFFFFFU}) {
    std::mt19937 random(static_cast<uint32_t>(GetParam()));
    std::vector<uint32_t> keys(GetParam());
    for (uint32_t& key : keys)
      key = static_cast<uint32_t>(random()) % distinct * (distinct == 7U ? 613566756U : 1U);
    EXPECT_EQ(SortedOrder(keys), StableOrder(keys));
  }
}

// Both sides of what one, two and three digits hold, at the ends of what a key may be.
TEST(SortedOrder, IsTheStableSortOfKeysOfAnySpan) {
  for (const uint32_t span : {0U, 1U, 0x7FFU, 0x800U, 0x3FFFFFU, 0x400000U, 0xFFFFFFFEU}) {
    for (const uint32_t lowest : {0U, 0xFFFFFFFFU - span}) {
      std::mt19937 random(span);
      std::vector<uint32_t> keys(40000);
      for (uint32_t& key : keys) key = lowest + static_cast<uint32_t>(random() % (span + 1ULL));
      EXPECT_TRUE(SortedOrder(keys) == StableOrder(keys)) << lowest << " + " << span;
    }
  }
}

// As depths on a grid have them.
TEST(SortedOrder, IsTheStableSortOfKeysWhoseLowBitsAreTheSame) {
  for (const uint32_t step : {2U, 0x800U, 0x1000U, 0x80000000U}) {
    std::mt19937 random(step);
    std::vector<uint32_t> keys(40000);
    for (uint32_t& key : keys) key = static_cast<uint32_t>(random()) / step * step + step / 3;
    EXPECT_TRUE(SortedOrder(keys) == StableOrder(keys)) << step;
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, SortedOrderOf,
                         testing::Values(0, 1, 2, 1000, 16383, 16384, 32768, 32769, 200001));

}  // namespace
}  // namespace halflight
