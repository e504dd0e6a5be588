// How failing devices are planned and told of, and when frames were told to stop. No GL.
#include "renderer/device_fault.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "renderer/stop_times.h"

namespace halflight {
namespace {

std::vector<DeviceFault> First(int count, const std::string& text) {
  PlannedFaults faults = *PlannedFaults::Parse(text);
  std::vector<DeviceFault> found;
  for (int i = 0; i < count; ++i) found.push_back(faults.Next());
  return found;
}

TEST(PlannedFaults, ComeAtTheirDrawings) {
  using enum DeviceFault;
  EXPECT_THAT(First(4, "reset:2"), testing::ElementsAre(kNone, kReset, kNone, kNone));
  EXPECT_THAT(First(5, "hang:4-,out-of-memory:2-3"),
              testing::ElementsAre(kNone, kOutOfMemory, kOutOfMemory, kHang, kHang));
  EXPECT_THAT(First(2, "innocent-reset:1,gone:2"), testing::ElementsAre(kInnocentReset, kGone));
  EXPECT_THAT(First(2, "late:2"), testing::ElementsAre(kNone, kLate));
}

TEST(PlannedFaults, AreGoneOnlyFromThenOn) {
  PlannedFaults faults = *PlannedFaults::Parse("gone:2");
  faults.Next();
  EXPECT_FALSE(faults.gone());
  faults.Next();
  EXPECT_TRUE(faults.gone());
}

TEST(PlannedFaults, RefuseWhatTheyCannotRead) {
  for (const char* text : {"", "reset", "reset:", "reset:0", "reset:x", "reset:3-2", "reset:1-x",
                           "flood:1", "reset:1,", "none:1"}) {
    const auto faults = PlannedFaults::Parse(text);
    EXPECT_TRUE(absl::IsInvalidArgument(faults.status())) << text;
  }
  EXPECT_THAT(PlannedFaults::Parse("reset:1,flood:2").status().message(),
              testing::HasSubstr("\"flood:2\", allowed: "));
}

TEST(DeviceResets, TellWhetherTheFrameIsSuspect) {
  EXPECT_TRUE(IsDeviceReset(DeviceResetError(true)));
  EXPECT_FALSE(IsSuspect(DeviceResetError(true)));
  EXPECT_TRUE(IsDeviceReset(DeviceResetError(false)));
  EXPECT_TRUE(IsSuspect(DeviceResetError(false)));
  for (const absl::Status& other : {absl::OkStatus(), absl::UnavailableError("shutting down"),
                                    DeviceGoneError(absl::NotFoundError("none"))}) {
    EXPECT_FALSE(IsDeviceReset(other)) << other;
    EXPECT_FALSE(IsSuspect(other)) << other;
  }
}

TEST(StopTimes, AreThatOfTheFrameThatWasToldFirst) {
  StopTimes times;
  std::stop_source never;
  std::stop_source first;
  std::stop_source second;
  const auto unstoppable = times.Watch({});
  const auto running = times.Watch(never.get_token());
  auto a = times.Watch(second.get_token());
  auto b = times.Watch(first.get_token());
  EXPECT_EQ(times.first(), std::nullopt);
  const auto before = StopTimes::Clock::now();
  first.request_stop();
  const auto between = StopTimes::Clock::now();
  second.request_stop();
  ASSERT_TRUE(times.first().has_value());
  EXPECT_GE(*times.first(), before);
  EXPECT_LE(*times.first(), between);
  b.reset();  // back
  ASSERT_TRUE(times.first().has_value());
  EXPECT_GE(*times.first(), between);
  a.reset();
  EXPECT_EQ(times.first(), std::nullopt);
}

TEST(StopTimes, CountFromTheBeginningWhereAFrameWasToldBefore) {
  StopTimes times;
  std::stop_source stop;
  stop.request_stop();
  const auto before = StopTimes::Clock::now();
  const auto frame = times.Watch(stop.get_token());
  ASSERT_TRUE(times.first().has_value());
  EXPECT_GE(*times.first(), before);
}

}  // namespace
}  // namespace halflight
