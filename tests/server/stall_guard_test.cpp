// Who is noticed to stall, and who is not.
#include "server/stall_guard.h"

#include <atomic>
#include <future>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

namespace halflight {
namespace {

using std::chrono::milliseconds;

TEST(StallGuard, CallsOfWhatDoesNotEndWithinTheLimit) {
  std::promise<void> stalled;
  Timer timer;
  StallGuard guard(timer, {.at_once = milliseconds(20)}, [&] { stalled.set_value(); });
  guard.Begin();
  stalled.get_future().wait();
}

TEST(StallGuard, CountsEveryOperationFromItsOwnBeginning) {
  int calls = 0;
  std::promise<void> stalled;
  Timer timer;
  StallGuard guard(timer, {.at_once = milliseconds(50)}, [&] {
    ++calls;
    stalled.set_value();
  });
  for (int i = 0; i < 100; ++i) {
    guard.Begin();
    guard.End(1);
  }
  guard.Begin();
  stalled.get_future().wait();
  guard.End(1);
  EXPECT_EQ(calls, 1);
}

TEST(StallGuard, TimeIsWonBackByBytes) {
  Patience patience({.at_once = milliseconds(1000), .bytes_per_second = 500});
  patience.Spend(milliseconds(600), 0);
  EXPECT_EQ(patience.left(), milliseconds(400));
  patience.Spend(milliseconds(300), 50);
  EXPECT_EQ(patience.left(), milliseconds(200));
  patience.Spend(milliseconds(0), 1'000'000'000'000'000'000);
  EXPECT_EQ(patience.left(), milliseconds(1000)) << "never more than at first";
  patience.Spend(milliseconds(1200), 50);
  EXPECT_EQ(patience.left(), milliseconds(0));
  patience.Restore();
  EXPECT_EQ(patience.left(), milliseconds(1000));
  Patience any({.at_once = milliseconds(1000)});
  any.Spend(milliseconds(600), 0);
  EXPECT_EQ(any.left(), milliseconds(400));
  any.Spend(milliseconds(300), 1);
  EXPECT_EQ(any.left(), milliseconds(1000));
}

TEST(StallGuard, CallsOfWhatIsTooSlowHoweverSteady) {
  std::atomic<bool> stalled = false;
  Timer timer;
  StallGuard guard(timer, {.at_once = milliseconds(200), .bytes_per_second = 1000},
                   [&] { stalled = true; });
  for (int i = 0; i < 100 && !stalled; ++i) {
    guard.Begin();
    std::this_thread::sleep_for(milliseconds(20));
    guard.End(1);
  }
  EXPECT_TRUE(stalled);
}

TEST(StallGuard, NeverCallsWithoutALimit) {
  bool called = false;
  std::promise<void> later;
  Timer timer;
  StallGuard guard(timer, {.at_once = milliseconds(0)}, [&] { called = true; });
  guard.Begin();
  timer.At(Timer::Clock::now() + milliseconds(20), [&] { later.set_value(); });
  later.get_future().wait();
  EXPECT_FALSE(called);
}

// What the sanitizers look at: the call meets the guard's end at every moment of it.
TEST(StallGuard, NeverCallsOnceItIsGone) {
  Timer timer;
  int calls = 0;
  for (int i = 0; i < 500; ++i) {
    auto alive = std::make_unique<int>(0);
    {
      StallGuard guard(timer, {.at_once = milliseconds(1)},
                       [&calls, alive = alive.get()] { calls += ++*alive; });
      guard.Begin();
      std::this_thread::sleep_for(std::chrono::microseconds(950 + i));
    }
    alive.reset();
  }
  EXPECT_LE(calls, 500);
}

TEST(StallGuard, MayBeEndedByItsCall) {
  std::promise<void> begun;
  std::promise<void> ended;
  Timer timer;
  std::unique_ptr<StallGuard> guard;
  guard = std::make_unique<StallGuard>(timer, PatienceLimits{.at_once = milliseconds(1)}, [&] {
    begun.get_future().wait();
    guard.reset();
    ended.set_value();
  });
  guard->Begin();
  begun.set_value();
  ended.get_future().wait();
}

}  // namespace
}  // namespace halflight
