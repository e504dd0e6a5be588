// A device that is reset, runs out of memory or is lost: whose frames fail, and that those after it
// are as before. Planned on a sound one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <future>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "renderer/gl/object.h"
#include "renderer/render_thread.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using Frame = absl::StatusOr<FrameResult>;

FrameRequest Request(int size = 48) {
  Scene scene = test::BallScene(200, size);
  scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  scene.shadow.slices = 4;
  scene.shadow.light_buffer_size = 64;
  return test::Beauty(scene);
}

class DeviceReset : public testing::Test {
 protected:
  void Start(const std::string& faults, int frames_in_flight = 1) {
    RenderThreadOptions options{.renderer = {.frames_in_flight = frames_in_flight}};
    if (!faults.empty()) {
      options.renderer.faults = std::make_shared<PlannedFaults>(*PlannedFaults::Parse(faults));
    }
    engine_.reset();
    engine_ = *StartRenderThread(options);
  }

  std::future<Frame> Submit(FrameRequest request, std::stop_token stop = {}) {
    auto promise = std::make_shared<std::promise<Frame>>();
    const absl::Status accepted =
        engine_->Submit(std::move(request), std::move(stop),
                        [promise](Frame frame) { promise->set_value(std::move(frame)); });
    if (!accepted.ok()) promise->set_value(accepted);
    return promise->get_future();
  }
  Frame Render(FrameRequest request = Request()) { return Submit(std::move(request)).get(); }

  std::unique_ptr<FrameEngine> engine_;
};

TEST_F(DeviceReset, FailsTheFrameAndNoneAfterIt) {
  Start("reset:2");
  const Frame before = Render();
  ASSERT_TRUE(before.ok()) << before.status();
  EXPECT_EQ(engine_->state().device_resets, 0U);
  const Frame under = Render();
  EXPECT_TRUE(absl::IsUnavailable(under.status())) << under.status();
  EXPECT_TRUE(IsSuspect(under.status()));
  const Frame after = Render();
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_TRUE(after->images.at(0).pixels == before->images.at(0).pixels);
  EXPECT_EQ(engine_->state().device_resets, 1U);
  EXPECT_TRUE(engine_->state().end.ok());
  EXPECT_EQ(engine_->state().overdue_since, std::nullopt);
}

TEST_F(DeviceReset, OfSomebodyElseSuspectsNobody) {
  Start("innocent-reset:1");
  const Frame under = Render();
  EXPECT_TRUE(IsDeviceReset(under.status())) << under.status();
  EXPECT_FALSE(IsSuspect(under.status()));
  EXPECT_TRUE(Render().ok());
}

// The second of two frames in flight brings both down; those that wait are rendered.
TEST_F(DeviceReset, FailsAllThatAreInFlightAndNoneThatWaits) {
  Start("reset:2", 2);
  std::deque<std::future<Frame>> frames;
  for (int i = 0; i < 5; ++i) frames.push_back(Submit(Request()));
  std::vector<bool> failed;
  for (std::future<Frame>& frame : frames) {
    const Frame result = frame.get();
    failed.push_back(!result.ok());
    EXPECT_TRUE(result.ok() || IsSuspect(result.status())) << result.status();
  }
  // The first may have been finished before the second was begun.
  EXPECT_TRUE(failed[1]);
  EXPECT_THAT(std::vector<bool>(failed.begin() + 2, failed.end()), testing::Each(false));
}

TEST_F(DeviceReset, FailsNoOtherThanAFrameThatWantsToBeAlone) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    Start("reset:2", 2);
    FrameRequest alone = Request();
    alone.alone = true;
    std::deque<std::future<Frame>> frames;
    frames.push_back(Submit(Request()));
    frames.push_back(Submit(alone));
    frames.push_back(Submit(Request()));
    EXPECT_TRUE(frames[0].get().ok());
    EXPECT_TRUE(IsSuspect(frames[1].get().status()));
    EXPECT_TRUE(frames[2].get().ok());
  }
}

TEST_F(DeviceReset, LeavesNothingOfTheDeviceBehind) {
  Start("reset:3,reset:6");
  ASSERT_TRUE(Render().ok());
  const EngineState before = engine_->state();
  EXPECT_GT(before.gl_objects, 0U);
  EXPECT_GT(before.gl_bytes, 64U * 64U * 4U);
  for (int i = 0; i < 8; ++i) Render().IgnoreError();
  EXPECT_EQ(engine_->state().device_resets, 2U);
  EXPECT_EQ(engine_->state().gl_objects, before.gl_objects);
  EXPECT_EQ(engine_->state().gl_bytes, before.gl_bytes);
  engine_.reset();
  EXPECT_EQ(gl::HeldMemory().objects, 0U);
  EXPECT_EQ(gl::HeldMemory().bytes, 0U);
}

TEST_F(DeviceReset, WithoutAnotherDeviceEndsTheEngine) {
  Start("gone:2");
  EXPECT_TRUE(Render().ok());
  auto under = Submit(Request());
  auto waits = Submit(Request());
  EXPECT_TRUE(IsDeviceReset(under.get().status()));
  const Frame waited = waits.get();
  EXPECT_TRUE(absl::IsUnavailable(waited.status())) << waited.status();
  EXPECT_FALSE(IsDeviceReset(waited.status()));
  EXPECT_TRUE(absl::IsUnavailable(engine_->state().end));
  EXPECT_EQ(Render().status(), engine_->state().end);
}

TEST_F(DeviceReset, WithoutMemoryIsTriedAgainWithoutWhatWasKept) {
  Start("out-of-memory:2,out-of-memory:4-5");
  const auto reused = [](const FrameResult& frame) {
    return std::any_of(frame.plan.passes.begin(), frame.plan.passes.end(),
                       [](const PlannedPass& pass) { return pass.count == 0; });
  };
  const FrameRequest request = Request();
  const Frame first = Render(request);
  const Frame tried_again = Render(request);  // drawings 2 and 3
  ASSERT_TRUE(tried_again.ok()) << tried_again.status();
  EXPECT_TRUE(tried_again->images.at(0).pixels == first->images.at(0).pixels);
  EXPECT_FALSE(reused(*tried_again));
  const Frame without = Render(request);  // 4 and 5
  EXPECT_TRUE(absl::IsResourceExhausted(without.status())) << without.status();
  EXPECT_FALSE(IsDeviceReset(without.status()));
  for (const bool later : {false, true}) {
    const Frame after = Render(request);
    ASSERT_TRUE(after.ok()) << after.status();
    EXPECT_TRUE(after->images.at(0).pixels == first->images.at(0).pixels);
    EXPECT_EQ(reused(*after), later);
  }
  EXPECT_EQ(engine_->state().device_resets, 0U);
}

// A frame that was cancelled, answered so, and is still being drawn.
class BehindACancelledFrame : public DeviceReset {
 protected:
  void Begin(const std::string& faults, int cancelled) {
    Start(faults, 2);
    EXPECT_TRUE(Render().ok());  // so that the programs are there
    begun_ = std::chrono::steady_clock::now();
    std::deque<std::future<Frame>> frames;
    std::stop_source stop;
    for (int i = 0; i < cancelled; ++i) frames.push_back(Submit(Request(), stop.get_token()));
    // By then they have been begun: what is stopped before is never drawn.
    std::this_thread::sleep_for(kLateness / 4);
    stop.request_stop();
    for (std::future<Frame>& frame : frames) {
      EXPECT_TRUE(absl::IsCancelled(frame.get().status()));
    }
  }
  // Whether the device had come to the end of the cancelled ones before that.
  [[nodiscard]] bool IsBehindThem() const {
    return std::chrono::steady_clock::now() - begun_ >= kLateness;
  }

 private:
  std::chrono::steady_clock::time_point begun_;
};

// Any of both may have been the cause.
TEST_F(BehindACancelledFrame, NoOtherIsASuspect) {
  Begin("late:2,reset:3", 1);
  const Frame other = Render();
  EXPECT_TRUE(IsDeviceReset(other.status())) << other.status();
  EXPECT_FALSE(IsSuspect(other.status()));
  EXPECT_TRUE(Render().ok());
}

TEST_F(BehindACancelledFrame, OneThatWantsToBeAloneWaits) {
  Begin("late:2", 1);
  FrameRequest alone = Request();
  alone.alone = true;
  EXPECT_TRUE(Render(alone).ok());
  EXPECT_TRUE(IsBehindThem());
}

TEST_F(BehindACancelledFrame, NoMoreAreBegunThanMayBeInFlight) {
  Begin("late:2-3", 2);
  EXPECT_TRUE(Render().ok());
  EXPECT_TRUE(IsBehindThem());
}

// While the first is still drawn, which is late.
TEST_F(DeviceReset, AnswersAStoppedFrameBeforeItsTurn) {
  Start("late:1");
  std::stop_source stop;
  auto first = Submit(Request());
  auto second = Submit(Request());
  auto stopped = Submit(Request(), stop.get_token());
  stop.request_stop();
  EXPECT_TRUE(absl::IsCancelled(stopped.get().status()));
  EXPECT_EQ(second.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  EXPECT_TRUE(first.get().ok());
  EXPECT_TRUE(second.get().ok());
}

// With two in flight cancelled ones are answered at once, and looked after until the device is
// through with them.
TEST_F(DeviceReset, CancelledFramesLeaveNothingBehind) {
  for (const int frames_in_flight : {1, 2}) {
    Start("", frames_in_flight);
    const Frame before = Render();
    const EngineState state = engine_->state();
    for (int i = 0; i < 30; ++i) {
      std::stop_source stop;
      auto cancelled = Submit(Request(96), stop.get_token());
      auto other = Submit(Request());
      if (i % 3 > 0) std::this_thread::sleep_for(std::chrono::microseconds(300 * i));
      stop.request_stop();
      const Frame result = cancelled.get();
      EXPECT_TRUE(result.ok() || absl::IsCancelled(result.status())) << result.status();
      const Frame kept = other.get();
      ASSERT_TRUE(kept.ok()) << kept.status();
      EXPECT_TRUE(kept->images.at(0).pixels == before->images.at(0).pixels);
    }
    EXPECT_EQ(engine_->state().overdue_since, std::nullopt);
    EXPECT_LE(engine_->state().gl_objects, state.gl_objects + 8);
  }
}

}  // namespace
}  // namespace halflight
