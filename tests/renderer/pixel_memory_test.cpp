#include "renderer/pixel_memory.h"

#include <algorithm>
#include <stop_token>
#include <vector>

#include <gtest/gtest.h>

namespace halflight {
namespace {

// Enough for a mapping of its own.
constexpr size_t kMany = size_t{10} << 20U;

TEST(PixelMemory, HasAsManyZerosAsAsked) {
  for (const size_t count : {size_t{0}, size_t{1}, size_t{1000}, kMany}) {
    const std::vector<float> zeros = Zeros(count);
    EXPECT_EQ(zeros.size(), count);
    EXPECT_EQ(static_cast<size_t>(std::count(zeros.begin(), zeros.end(), 0.0F)), count);
  }
}

TEST(PixelMemory, TakesNoneOnceStopped) {
  std::stop_source stop;
  EXPECT_EQ(Zeros(kMany, stop.get_token()).size(), kMany);
  stop.request_stop();
  EXPECT_EQ(Zeros(kMany, stop.get_token()).size(), 0U);
}

TEST(PixelMemory, ReservesWithoutChangingWhatIsThere) {
  std::vector<float> values = {1.0F, 2.0F};
  ReservePixels(kMany, values);
  EXPECT_GE(values.capacity(), kMany);
  EXPECT_EQ(values, (std::vector<float>{1.0F, 2.0F}));
}

}  // namespace
}  // namespace halflight
