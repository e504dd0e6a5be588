#include "server/timer.h"

#include <future>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace halflight {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

TEST(Timer, CallsInTheOrderOfTimesWhateverTheOrderOfAsking) {
  std::vector<int> called;
  std::promise<void> last;
  Timer timer;
  const auto now = Timer::Clock::now();
  timer.At(now + milliseconds(60), [&] { last.set_value(); });
  timer.At(now + milliseconds(40), [&] { called.push_back(2); });
  timer.At(now + milliseconds(20), [&] { called.push_back(1); });
  timer.At(now + milliseconds(40), [&] { called.push_back(3); });
  last.get_future().wait();
  EXPECT_THAT(called, ::testing::ElementsAre(1, 2, 3));
}

TEST(Timer, CallsTheOnlyOneThereIs) {
  std::promise<void> called;
  Timer timer;
  // Until the timer waits for whatever may come.
  std::this_thread::sleep_for(milliseconds(20));
  timer.At(Timer::Clock::now(), [&] { called.set_value(); });
  EXPECT_EQ(called.get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
}

TEST(Timer, CancelledCallNeverComes) {
  bool called = false;
  std::promise<void> later;
  Timer timer;
  const auto now = Timer::Clock::now();
  const Timer::Ticket ticket = timer.At(now + milliseconds(20), [&] { called = true; });
  timer.At(now + milliseconds(40), [&] { later.set_value(); });
  timer.Cancel(ticket);
  timer.Cancel(ticket);
  later.get_future().wait();
  EXPECT_FALSE(called);
}

TEST(Timer, MayBeUsedFromACall) {
  std::promise<void> second;
  Timer timer;
  timer.At({}, [&] { timer.At({}, [&] { second.set_value(); }); });
  second.get_future().wait();
}

TEST(Timer, EndDoesNotWaitForWhatIsFarOff) {
  bool called = false;
  {
    Timer timer;
    timer.At(Timer::Clock::now() + hours(1), [&] { called = true; });
  }
  EXPECT_FALSE(called);
}

}  // namespace
}  // namespace halflight
