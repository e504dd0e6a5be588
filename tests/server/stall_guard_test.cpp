// Who is noticed to stall, and who is not.
#include "server/stall_guard.h"

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
  StallGuard guard(timer, milliseconds(20), [&] { stalled.set_value(); });
  guard.Begin();
  stalled.get_future().wait();
}

TEST(StallGuard, CountsEveryOperationFromItsOwnBeginning) {
  int calls = 0;
  std::promise<void> stalled;
  Timer timer;
  StallGuard guard(timer, milliseconds(50), [&] {
    ++calls;
    stalled.set_value();
  });
  for (int i = 0; i < 100; ++i) {
    guard.Begin();
    guard.End();
  }
  guard.Begin();
  stalled.get_future().wait();
  guard.End();
  EXPECT_EQ(calls, 1);
}

TEST(StallGuard, NeverCallsWithoutALimit) {
  bool called = false;
  std::promise<void> later;
  Timer timer;
  StallGuard guard(timer, milliseconds(0), [&] { called = true; });
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
      StallGuard guard(timer, milliseconds(1),
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
  guard = std::make_unique<StallGuard>(timer, milliseconds(1), [&] {
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
