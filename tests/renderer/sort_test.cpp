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

class SortedOrderOf : public testing::TestWithParam<size_t> {};

TEST_P(SortedOrderOf, IsTheStableSortOfItsKeys) {
  // Few distinct keys in half of the cases, so that stability shows; sizes on both sides of what
  // goes to several threads.
  for (const uint32_t distinct : {7U, 0xFFFFFFFFU}) {
    std::mt19937 random(static_cast<uint32_t>(GetParam()));
    std::vector<uint32_t> keys(GetParam());
    for (uint32_t& key : keys)
      key = static_cast<uint32_t>(random()) % distinct * (distinct == 7U ? 613566756U : 1U);
    std::vector<uint32_t> expected(keys.size());
    std::iota(expected.begin(), expected.end(), 0U);
    std::stable_sort(expected.begin(), expected.end(),
                     [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
    EXPECT_EQ(SortedOrder(keys), expected);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, SortedOrderOf,
                         testing::Values(0, 1, 2, 1000, 16383, 16384, 32768, 32769, 200001));

}  // namespace
}  // namespace halflight
