// Whose turn it is: shares of the renderer's time, priorities, cancellation. With an engine that
// renders when it is told to, and a clock that goes as it is told.

#include "server/frame_queue.h"

#include <deque>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "renderer/device_fault.h"
#include "server/error_detail.h"

namespace halflight {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;

class ManualEngine : public FrameEngine {
 public:
  absl::Status Submit(FrameRequest request, std::stop_token /*stop*/, Done done) override {
    if (!refusal.ok()) {
      return refusal;
    }
    jobs_.push_back(std::move(done));
    alone.push_back(request.alone);
    return absl::OkStatus();
  }
  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

  // Finishes the oldest frame.
  void Render(absl::StatusOr<FrameResult> result = FrameResult{}) {
    const Done done = std::move(jobs_.front());
    jobs_.pop_front();
    done(std::move(result));
  }
  [[nodiscard]] size_t given() const { return jobs_.size(); }

  absl::Status refusal;
  std::vector<bool> alone;  // of what it was given

 private:
  const DeviceInfo device_{};
  std::deque<Done> jobs_;
};

class Queue : public ::testing::Test {
 protected:
  void Push(const std::string& client, const std::string& name, QueuedFrame frame = {}) {
    frame.client = client;
    frame.done = [this, name](const absl::StatusOr<FrameResult>& result) {
      done_.push_back(name);
      results_.push_back(result);
    };
    queue_.Push(std::move(frame));
  }
  // Renders as many frames, each of which takes so long.
  void Render(int frames, seconds each) {
    for (int i = 0; i < frames; ++i) {
      now_ += each;
      engine_.Render();
    }
  }

  ManualEngine engine_;
  FrameQueue::Clock::time_point now_;
  FrameQueue queue_{engine_, 1, [this] { return now_; }};
  std::vector<std::string> done_;
  std::vector<absl::StatusOr<FrameResult>> results_;
};

TEST_F(Queue, ClientsTakeTurnsHoweverManyFramesEachSends) {
  for (const char* name : {"a1", "a2", "a3", "a4"}) {
    Push("a", name);
  }
  Push("b", "b1");
  Push("b", "b2");
  Render(6, seconds(1));
  EXPECT_THAT(done_, ElementsAre("a1", "b1", "a2", "b2", "a3", "a4"));
}

TEST_F(Queue, LongFrameCostsItsClientAsManyShortOnesOfAnother) {
  Push("a", "long 1");
  Push("a", "long 2");
  for (const char* name : {"b1", "b2", "b3", "b4"}) {
    Push("b", name);
  }
  Render(1, seconds(3));
  Render(5, seconds(1));
  EXPECT_THAT(done_, ElementsAre("long 1", "b1", "b2", "b3", "long 2", "b4"));
}

TEST_F(Queue, ClientThatRestedHasNoClaimToTheTimeItDidNotUse) {
  for (int i = 0; i < 100; ++i) {
    Push("a", "early");
  }
  Render(90, seconds(1));
  for (const char* name : {"b1", "b2", "b3"}) {
    Push("b", name);
  }
  done_.clear();
  Render(6, seconds(1));
  EXPECT_THAT(done_, ElementsAre("early", "b1", "early", "b2", "early", "b3"));
  Render(7, seconds(1));
}

TEST_F(Queue, PausesBetweenLongFramesDoNotMakeThemFree) {
  for (int i = 0; i < 8; ++i) {
    Push("short", "short");
  }
  Push("z", "long");
  Render(1, seconds(1));
  Render(1, seconds(4));
  Push("z", "long");  // nothing of it waited meanwhile
  Render(4, seconds(1));
  EXPECT_THAT(done_, ElementsAre("short", "long", "short", "short", "short", "short"));
  Render(1, seconds(4));
  EXPECT_EQ(done_.back(), "long");
  Render(3, seconds(1));
}

TEST_F(Queue, PriorityCountsWithinAClientAndNotBetween) {
  Push("a", "first");
  Push("a", "low", {.priority = -5});
  Push("a", "usual");
  Push("a", "high", {.priority = 9});
  Push("a", "as high", {.priority = 9});
  Push("b", "other", {.priority = -100});
  Render(6, seconds(1));
  EXPECT_THAT(done_, ElementsAre("first", "other", "high", "as high", "usual", "low"));
}

TEST_F(Queue, FrameThatGoesOnComesBeforeNewOnesOfItsClient) {
  Push("a", "under way");
  Push("a", "high", {.priority = 9});
  Push("a", "second pass", {.goes_on = true});
  Render(3, seconds(1));
  EXPECT_THAT(done_, ElementsAre("under way", "second pass", "high"));
}

TEST_F(Queue, CancelledWhileItWaitsEndsAtOnceAndIsNeverRendered) {
  std::stop_source stop;
  bool begun = false;
  Push("a", "under way");
  Push("a", "cancelled", {.stop = stop.get_token(), .begun = [&] { begun = true; }});
  stop.request_stop();
  EXPECT_THAT(done_, ElementsAre("cancelled")) << "it waited for the frame before it";
  EXPECT_EQ(results_.at(0).status().code(), absl::StatusCode::kCancelled);
  Render(1, seconds(1));
  EXPECT_EQ(engine_.given(), 0U);
  EXPECT_FALSE(begun);
}

TEST_F(Queue, CancelledBeforeItCameIsNotRendered) {
  std::stop_source stop;
  stop.request_stop();
  Push("a", "cancelled", {.stop = stop.get_token()});
  EXPECT_THAT(done_, ElementsAre("cancelled"));
  EXPECT_EQ(engine_.given(), 0U);
}

TEST_F(Queue, CancelledWhileItRendersIsTheEnginesAffair) {
  std::stop_source stop;
  Push("a", "under way", {.stop = stop.get_token()});
  stop.request_stop();
  EXPECT_TRUE(done_.empty());
  Render(1, seconds(1));
  EXPECT_TRUE(results_.at(0).ok());
}

TEST_F(Queue, EngineGetsNoMoreThanItIsToHave) {
  FrameQueue two(engine_, 2);
  for (int i = 0; i < 3; ++i) {
    two.Push({.client = "a", .done = [](const absl::StatusOr<FrameResult>&) {}});
  }
  EXPECT_EQ(engine_.given(), 2U);
  engine_.Render();
  EXPECT_EQ(engine_.given(), 2U);
  engine_.Render();
  engine_.Render();
}

TEST_F(Queue, RefusalOfTheEngineEndsOneFrameAndNotTheQueue) {
  Push("a", "under way");
  Push("a", "refused");
  Push("b", "refused too");
  engine_.refusal = absl::UnavailableError("shutting down");
  Render(1, seconds(1));
  EXPECT_THAT(done_, ElementsAre("refused too", "refused", "under way"));
  EXPECT_EQ(results_.at(0).status().code(), absl::StatusCode::kUnavailable);
  engine_.refusal = absl::OkStatus();
  Push("a", "rendered");
  Render(1, seconds(1));
  EXPECT_EQ(done_.back(), "rendered");
}

TEST_F(Queue, TimingsBeginWithTheWaitForTheTurn) {
  Push("a", "first");
  Push("a", "second");
  Render(2, seconds(2));
  ASSERT_FALSE(results_.at(1)->timings.empty());
  EXPECT_EQ(results_.at(1)->timings.front().stage, "queue");
  EXPECT_DOUBLE_EQ(results_.at(1)->timings.front().milliseconds, 2000.0);
}

// Also of what waited already when the second happened.
TEST_F(Queue, FrameThatTheDeviceFailedUnderTwiceIsRefused) {
  for (int i = 0; i < 3; ++i) {
    Push("a", "deadly", {.fingerprint = "deadly"});
  }
  Push("a", "harmless", {.fingerprint = "harmless"});
  engine_.Render(DeviceResetError(false));
  engine_.Render(DeviceResetError(false));
  EXPECT_THAT(done_, ElementsAre("deadly", "deadly", "deadly"));
  // The next one's turn comes before a frame is answered.
  EXPECT_EQ(results_.at(2).status().code(), absl::StatusCode::kUnavailable);
  const absl::Status refused = results_.at(1).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(DetailOf(refused).reason, v1::ERROR_REASON_FAULTED_TWICE);
  EXPECT_EQ(DetailOf(refused).retry_after, std::nullopt);
  Render(1, seconds(1));
  EXPECT_TRUE(results_.at(3).ok());
  // The second was drawn alone, so that nobody else could be suspected.
  EXPECT_THAT(engine_.alone, ElementsAre(false, true, false));
}

TEST_F(Queue, FrameThatIsNotSuspectIsDrawnAgain) {
  for (const absl::Status& failure :
       {DeviceResetError(true), absl::InternalError("a fault of GL"), DeviceResetError(true)}) {
    Push("a", "unlucky", {.fingerprint = "unlucky"});
    engine_.Render(failure);
  }
  Push("a", "unlucky", {.fingerprint = "unlucky"});
  EXPECT_EQ(engine_.given(), 1U);
  Render(1, seconds(1));
  EXPECT_THAT(engine_.alone, ::testing::Each(false));
}

TEST(FaultedRequests, ForgetTheOldestBeyondTheirBound) {
  FaultedRequests faulted;
  faulted.Blame("old");
  faulted.Blame("kept");
  for (size_t i = 0; i + 2 < FaultedRequests::kMost; ++i) {
    faulted.Blame(std::to_string(i));
  }
  faulted.Blame("kept");
  EXPECT_EQ(faulted.Count("old"), 1);
  faulted.Blame("new");
  EXPECT_EQ(faulted.Count("old"), 0);
  EXPECT_EQ(faulted.Count("kept"), 2);
  EXPECT_EQ(faulted.Count("new"), 1);
}

}  // namespace
}  // namespace halflight
