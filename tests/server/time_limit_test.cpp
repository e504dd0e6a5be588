#include "server/time_limit.h"

#include <atomic>
#include <future>
#include <thread>

#include <gtest/gtest.h>

namespace halflight {
namespace {

using std::chrono::milliseconds;

TEST(TimeLimit, IsExceededByRunningAndNotByWaiting) {
  Timer timer;
  std::promise<void> exceeded;
  auto future = exceeded.get_future();
  TimeLimit limit(timer, milliseconds(50), [&] { exceeded.set_value(); });
  EXPECT_EQ(future.wait_for(milliseconds(100)), std::future_status::timeout) << "not begun";
  limit.Run();
  limit.Pause();
  EXPECT_EQ(future.wait_for(milliseconds(100)), std::future_status::timeout) << "paused";
  limit.Run();
  limit.Run();
  EXPECT_EQ(future.wait_for(std::chrono::seconds(10)), std::future_status::ready);
}

// However often it pauses.
TEST(TimeLimit, CountsAllThatItRan) {
  Timer timer;
  std::atomic<bool> exceeded = false;
  TimeLimit limit(timer, milliseconds(100), [&] { exceeded = true; });
  for (int i = 0; i < 200 && !exceeded; ++i) {
    limit.Run();
    std::this_thread::sleep_for(milliseconds(10));
    limit.Pause();
  }
  EXPECT_TRUE(exceeded);
}

TEST(TimeLimit, OfTheLongestTimeIsNone) {
  Timer timer;
  std::atomic<bool> exceeded = false;
  TimeLimit limit(timer, milliseconds::max(), [&] { exceeded = true; });
  limit.Run();
  std::this_thread::sleep_for(milliseconds(20));
  limit.Pause();
  EXPECT_FALSE(exceeded);
}

}  // namespace
}  // namespace halflight
