// The device's sort against the CPU's and the standard library's.
#include "renderer/passes/sort_keys.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <tuple>

#include "renderer/sort.h"
#include "tests/renderer/device_fixture.h"

namespace halflight {
namespace {

std::vector<uint32_t> StableOrder(const std::vector<uint32_t>& keys) {
  std::vector<uint32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
  return order;
}

std::vector<uint32_t> RandomKeys(size_t count, uint32_t mask) {
  std::mt19937 random(static_cast<uint32_t>(count));
  std::vector<uint32_t> keys(count);
  for (uint32_t& key : keys) key = static_cast<uint32_t>(random()) & mask;
  return keys;
}

// Depths as particles have them, and what else a float may be.
std::vector<uint32_t> FloatKeys(size_t count) {
  constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
  constexpr float kSpecial[] = {0.0F,
                                -0.0F,
                                kDenormal,
                                -kDenormal,
                                3.0F * kDenormal,
                                std::numeric_limits<float>::max(),
                                std::numeric_limits<float>::lowest()};
  std::mt19937 random(static_cast<uint32_t>(count));
  std::normal_distribution<float> normal;
  std::vector<uint32_t> keys(count);
  for (uint32_t& key : keys) {
    const auto pick = static_cast<uint32_t>(random()) % 64;
    key = OrderedKey(pick < std::size(kSpecial) ? kSpecial[pick] : normal(random));
  }
  return keys;
}

struct KeyPattern {
  const char* name;
  std::function<std::vector<uint32_t>(size_t count)> make;
};

const KeyPattern kPatterns[] = {
    {"Random", [](size_t count) { return RandomKeys(count, 0xFFFFFFFFU); }},
    {"Duplicates", [](size_t count) { return RandomKeys(count, 0x03000300U); }},
    {"Equal", [](size_t count) { return std::vector<uint32_t>(count, 0xDEADBEEFU); }},
    {"Sorted",
     [](size_t count) {
       std::vector<uint32_t> keys = RandomKeys(count, 0xFFFFFFFFU);
       std::sort(keys.begin(), keys.end());
       return keys;
     }},
    {"Reversed",
     [](size_t count) {
       std::vector<uint32_t> keys = RandomKeys(count, 0xFFFFFFFFU);
       std::sort(keys.begin(), keys.end(), std::greater<>());
       return keys;
     }},
    {"Floats", FloatKeys},
};

class SortKeysOf : public test::DeviceTest,
                   public testing::WithParamInterface<std::tuple<KeyPattern, size_t>> {};

TEST_P(SortKeysOf, IsTheOrderOfTheCpuAndOfAStableSort) {
  const auto& [pattern, count] = GetParam();
  const std::vector<uint32_t> keys = pattern.make(count);
  absl::StatusOr<KeyedValues> sorted =
      SortKeys(Device(), {gl::MakeBuffer("keys", keys), gl::Buffer()}, count);
  ASSERT_TRUE(sorted.ok()) << sorted.status();
  const std::vector<uint32_t> order = test::ReadBuffer<uint32_t>(sorted->values, count);
  EXPECT_TRUE(order == SortedOrder(keys));
  EXPECT_TRUE(order == StableOrder(keys));
  const std::vector<uint32_t> sorted_keys = test::ReadBuffer<uint32_t>(sorted->keys, count);
  for (size_t k = 0; k < count; ++k) ASSERT_EQ(sorted_keys[k], keys[order[k]]) << k;
}

std::string NameOf(const testing::TestParamInfo<std::tuple<KeyPattern, size_t>>& tested) {
  return std::get<0>(tested.param).name + std::to_string(std::get<1>(tested.param));
}

// Both sides of a block's share.
INSTANTIATE_TEST_SUITE_P(Patterns, SortKeysOf,
                         testing::Combine(testing::ValuesIn(kPatterns),
                                          testing::Values(0, 1, 10, 4095, 4096, 4097, 200001)),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(Large, SortKeysOf,
                         testing::Values(std::tuple(kPatterns[5], size_t{10000000})), NameOf);

class SortKeysTest : public test::DeviceTest {};

TEST_F(SortKeysTest, MovesValuesWithKeysOfAsManyBitsAsAreAsked) {
  for (const int bits : {1, 8, 9, 17, 24}) {
    const std::vector<uint32_t> keys = RandomKeys(30000, (1U << static_cast<uint32_t>(bits)) - 1);
    std::vector<uint32_t> values(keys.size());
    for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<uint32_t>(7 * i + 5);
    absl::StatusOr<KeyedValues> sorted =
        SortKeys(Device(), {gl::MakeBuffer("keys", keys), gl::MakeBuffer("values", values)},
                 keys.size(), bits);
    ASSERT_TRUE(sorted.ok()) << sorted.status();
    std::vector<uint32_t> expected = StableOrder(keys);
    for (uint32_t& index : expected) index = values[index];
    EXPECT_TRUE(test::ReadBuffer<uint32_t>(sorted->values, keys.size()) == expected) << bits;
  }
}

TEST_F(SortKeysTest, NamesTheLimitThatTooManyKeysExceed) {
  const absl::Status status = SortKeys(Device(), {}, size_t{1} << 40U).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_NE(status.message().find("GL_MAX_SHADER_STORAGE_BLOCK_SIZE"), std::string::npos) << status;
}

}  // namespace
}  // namespace halflight
