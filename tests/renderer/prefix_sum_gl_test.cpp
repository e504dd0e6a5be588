// Prefix sums on the device against those of the standard library.
#include "renderer/passes/prefix_sum.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "tests/renderer/device_fixture.h"

namespace halflight {
namespace {

std::vector<uint32_t> ExclusiveSums(const std::vector<uint32_t>& values) {
  std::vector<uint32_t> sums(values.size() + 1, 0);
  std::inclusive_scan(values.begin(), values.end(), sums.begin() + 1);
  return sums;
}

class PrefixSumOf : public test::DeviceTest, public testing::WithParamInterface<size_t> {
 protected:
  // Sums that need all 32 bits.
  static std::vector<uint32_t> RandomValues(size_t count) {
    std::mt19937 random(static_cast<uint32_t>(count));
    const uint32_t largest = static_cast<uint32_t>(0xFFFFFFFFU / (count + 1));
    std::vector<uint32_t> values(count);
    for (uint32_t& value : values) value = static_cast<uint32_t>(random()) % (largest + 1);
    return values;
  }
};

TEST_P(PrefixSumOf, IsTheSumOfAllBefore) {
  const std::vector<uint32_t> values = RandomValues(GetParam());
  const gl::Buffer sums = gl::MakeBuffer("sums", (values.size() + 1) * sizeof(uint32_t));
  const absl::Status status =
      PrefixSum(Device(), gl::MakeBuffer("values", values), values.size(), sums);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_TRUE(test::ReadBuffer<uint32_t>(sums, values.size() + 1) == ExclusiveSums(values));
}

TEST_P(PrefixSumOf, MayReplaceItsValues) {
  std::vector<uint32_t> values = RandomValues(GetParam());
  const std::vector<uint32_t> expected = ExclusiveSums(values);
  values.push_back(12345);  // where the total goes: no value
  const gl::Buffer buffer = gl::MakeBuffer("values", values);
  const absl::Status status = PrefixSum(Device(), buffer, GetParam(), buffer);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_TRUE(test::ReadBuffer<uint32_t>(buffer, values.size()) == expected);
}

// Both sides of an invocation's, a workgroup's and a level's share.
INSTANTIATE_TEST_SUITE_P(Sizes, PrefixSumOf,
                         testing::Values(0, 1, 7, 8, 255, 256, 257, 2047, 2048, 2049, 65537,
                                         1000000, 2048 * 2048 - 1, 2048 * 2048, 10000000));

class PrefixSumTest : public test::DeviceTest {};

// More than llvmpipe's storage blocks hold.
TEST_F(PrefixSumTest, RunsInPartsWhereABlockOfStorageIsTooSmall) {
  constexpr size_t kCount = (size_t{1} << 25U) + 5000;
  const gl::Buffer buffer = gl::MakeBuffer("values", (kCount + 1) * sizeof(uint32_t));
  const uint32_t three = 3;
  glClearNamedBufferData(buffer.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &three);
  const absl::Status status = PrefixSum(Device(), buffer, kCount, buffer);
  ASSERT_TRUE(status.ok()) << status;
  const std::vector<uint32_t> sums = test::ReadBuffer<uint32_t>(buffer, kCount + 1);
  size_t wrong = 0;
  for (size_t k = 0; k <= kCount; ++k) wrong += sums[k] != 3 * k ? 1 : 0;
  EXPECT_EQ(wrong, 0U);
}

TEST_F(PrefixSumTest, EndsAtTheLargestNumber) {
  std::vector<uint32_t> values(5000, 1);
  values[2500] = 0xFFFFFFF0U;
  const gl::Buffer sums = gl::MakeBuffer("sums", (values.size() + 1) * sizeof(uint32_t));
  const absl::Status status =
      PrefixSum(Device(), gl::MakeBuffer("values", values), values.size(), sums);
  ASSERT_TRUE(status.ok()) << status;
  const std::vector<uint32_t> read = test::ReadBuffer<uint32_t>(sums, values.size() + 1);
  EXPECT_EQ(read[2500], 2500U);
  for (size_t k = 2501; k <= values.size(); ++k) ASSERT_EQ(read[k], 0xFFFFFFFFU) << k;
}

TEST_F(PrefixSumTest, RefusesMoreValuesThanItCanSum) {
  const absl::Status status =
      PrefixSum(Device(), gl::Buffer(), (size_t{1} << 28U) + 1, gl::Buffer());
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
}

}  // namespace
}  // namespace halflight
