// When a device is given up.

#include "server/supervision.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "renderer/device_fault.h"

namespace halflight {
namespace {

using std::chrono::seconds;
using Clock = std::chrono::steady_clock;
using ::testing::HasSubstr;

TEST(DeviceTrouble, IsADeviceThatHasNotComeBackForTooLong) {
  const Clock::time_point now = Clock::now();
  EngineState state;
  EXPECT_EQ(DeviceTrouble(state, seconds(10), now), std::nullopt);
  state.overdue_since = now - seconds(10);
  EXPECT_EQ(DeviceTrouble(state, seconds(10), now), std::nullopt);
  const auto trouble = DeviceTrouble(state, seconds(10), now + std::chrono::milliseconds(1));
  ASSERT_TRUE(trouble.has_value());
  EXPECT_THAT(*trouble, HasSubstr("10 s"));
  EXPECT_EQ(DeviceTrouble(state, seconds(0), now + seconds(100000)), std::nullopt) << "off";
}

TEST(DeviceTrouble, IsADeviceThatCannotBeHadAgain) {
  EngineState state;
  state.end = DeviceGoneError(absl::NotFoundError("no EGL device"));
  const auto trouble = DeviceTrouble(state, seconds(0), Clock::now());
  ASSERT_TRUE(trouble.has_value());
  EXPECT_THAT(*trouble, HasSubstr("no EGL device"));
}

}  // namespace
}  // namespace halflight
