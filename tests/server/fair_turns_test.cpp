// What whoever takes turns may rely on: what is called when, from where, and what the end waits
// for. Shares, priorities and cancellation as such: frame_queue_test.cpp.

#include "server/fair_turns.h"

#include <atomic>
#include <chrono>
#include <future>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace halflight {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;

class Turns : public ::testing::Test {
 protected:
  void Wait(const std::string& name, const std::string& client = "a", std::stop_token stop = {}) {
    turns_.Wait({.client = client,
                 .stop = std::move(stop),
                 .taken =
                     [this, name](const FairTurns::Turn& turn) {
                       events_.push_back(name);
                       turn_ = turn;
                     },
                 .cancelled = [this, name] { events_.push_back(name + " cancelled"); }});
  }
  void End(const std::string& name, seconds took = seconds(1)) {
    now_ += took;
    turns_.End(FairTurns::Turn(turn_), [this, name] { events_.push_back(name + " ended"); });
  }

  std::vector<std::string> events_;
  FairTurns::Turn turn_;  // the last one
  FairTurns::Clock::time_point now_;
  FairTurns turns_{1, [this] { return now_; }};
};

TEST_F(Turns, NextOneIsGivenItsTurnBeforeTheLastOneIsAnswered) {
  Wait("first");
  Wait("second");
  End("first");
  EXPECT_THAT(events_, ElementsAre("first", "second", "first ended"));
  EXPECT_EQ(turn_.begin - turn_.asked, seconds(1));
  End("second");
}

TEST_F(Turns, LongTurnCostsItsClientTheNextOnes) {
  Wait("a1", "a");
  Wait("a2", "a");
  Wait("b1", "b");
  Wait("b2", "b");
  EXPECT_EQ(turns_.waiting(), 3U);
  End("a1", seconds(5));
  End("b1");
  End("b2");
  End("a2");
  EXPECT_THAT(events_,
              ElementsAre("a1", "b1", "a1 ended", "b2", "b1 ended", "a2", "b2 ended", "a2 ended"));
}

TEST_F(Turns, StopEndsWhatWaitsAndNotWhatHasItsTurn) {
  std::stop_source stop;
  Wait("first", "a", stop.get_token());
  Wait("second", "a", stop.get_token());
  stop.request_stop();
  Wait("third", "a", stop.get_token());
  EXPECT_THAT(events_, ElementsAre("first", "second cancelled", "third cancelled"));
  EXPECT_EQ(turns_.waiting(), 0U);
  End("first");
}

// However many there are: the stack does not grow with them.
TEST_F(Turns, MayBeEndedAsSoonAsTheyAreTaken) {
  Wait("first");
  int ended = 0;
  int depth = 0;
  for (int i = 0; i < 3; ++i) {
    turns_.Wait({.client = "a", .taken = [&](const FairTurns::Turn& turn) {
                   EXPECT_EQ(++depth, 1);
                   turns_.End(turn, [&] { ++ended; });
                   --depth;
                 }});
  }
  End("first");
  EXPECT_EQ(ended, 3);
}

TEST_F(Turns, EndWaitsForWhatIsCalled) {
  std::atomic<bool> answered = false;
  std::promise<void> ending;
  std::jthread other;
  {
    FairTurns turns(1);
    turns.Wait({.client = "a", .taken = [&](const FairTurns::Turn& turn) {
                  other = std::jthread([&, turn] {
                    turns.End(turn, [&] {
                      ending.set_value();
                      std::this_thread::sleep_for(std::chrono::milliseconds(20));
                      answered = true;
                    });
                  });
                }});
    ending.get_future().wait();
  }
  EXPECT_TRUE(answered);
}

}  // namespace
}  // namespace halflight
