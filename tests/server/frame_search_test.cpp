// Frames with a target on their way through the pipeline, in made-up worlds where the tests say
// what rendering takes and what is measured. Which settings are chosen is the business of
// tests/target, so nothing here depends on it.

#include "server/frame_search.h"

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/frame_log.h"
#include "tests/process/wait_for.h"
#include "tests/server/pipeline_fixture.h"

namespace halflight {
namespace {

using testing::EncodePlain;
using ::testing::HasSubstr;
using testing::MakeParticles;
using testing::MakeRequest;
using testing::MustConvert;
using testing::Result;
using testing::WaitFor;

constexpr double kGoal = 0.25;

// Particles enough for many settings to differ; an output that shows the light buffer tells which
// settings made it.
v1::RenderFrameRequest TargetRequest() {
  v1::RenderFrameRequest request = MakeRequest();
  *request.mutable_scene()->mutable_inline_particles() =
      MakeParticles(500, {v1::PARTICLE_ATTRIBUTE_POSITION});
  request.mutable_scene()->mutable_material()->set_radius(0.02F);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_LIGHT_BUFFER);
  request.mutable_target()->set_max_error(kGoal);
  return request;
}

FrameError ErrorOf(double relative_rmse, const MeasureJob& job) {
  FrameError error;
  error.estimate.covered_pixels = 3000;
  error.estimate.sampled_pixels = job.map ? 3000 : 1024;
  const double spread = job.map ? 1.0 : 1.02;
  error.estimate.relative_rmse = {relative_rmse, relative_rmse / spread, relative_rmse * spread};
  error.estimate.milliseconds = 0.001;  // far less than rendering
  if (job.map) {
    error.map = Image{64, 48, 1, {"R", "G", "B"}, std::vector<float>(size_t{3} * 64 * 48)};
  }
  return error;
}

class Search : public testing::PipelineTest {
 protected:
  // What measurement number n, counted from 0, shows.
  using Shows = std::function<double(size_t n, const MeasureJob& job)>;

  void StartShowing(Shows shows) {
    Start({.encode = EncodePlain,
           .measure = [this, shows = std::move(shows)](
                          const Image&, const Scene&, const MeasureJob& job,
                          const std::stop_token&) -> absl::StatusOr<FrameError> {
             const std::lock_guard lock(mutex_);
             jobs_.push_back(job);
             return ErrorOf(shows(jobs_.size() - 1, job), job);
           }});
  }
  void StartShowing(std::vector<double> errors) {
    StartShowing([errors = std::move(errors)](size_t n, const MeasureJob&) {
      return errors[std::min(n, errors.size() - 1)];
    });
  }

  v1::FrameHeader HeaderOf(const v1::RenderFrameRequest& request) {
    const Result result = Submit(MustConvert(request)).get();
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? (*result)->header : v1::FrameHeader();
  }

  std::mutex mutex_;
  std::vector<MeasureJob> jobs_;  // measured
};

int ReturnedOf(const v1::FrameHeader& header) {
  int returned = -1;
  for (int i = 0; i < header.target().attempts_size(); ++i) {
    if (header.target().attempts(i).returned()) {
      EXPECT_EQ(returned, -1);
      returned = i;
    }
  }
  return returned;
}

// All that is told of the frame is of the attempt that is said to be returned.
void ExpectOfReturned(const v1::FrameHeader& header) {
  ASSERT_GE(ReturnedOf(header), 0);
  const v1::TargetAttempt& returned = header.target().attempts(ReturnedOf(header));
  EXPECT_EQ(header.metadata().shadow().ShortDebugString(), returned.shadow().ShortDebugString());
  EXPECT_EQ(header.outputs(1).width(), returned.shadow().light_buffer_size());
  EXPECT_EQ(header.error().relative_rmse().value(), returned.relative_rmse().value());
  EXPECT_EQ(header.target().met(), returned.met());
}

TEST_F(Search, GoesOnUntilTheErrorIsMeasuredToBeMet) {
  StartShowing({1.3 * kGoal, 0.5 * kGoal});
  const v1::FrameHeader header = HeaderOf(TargetRequest());
  EXPECT_EQ(header.target().target().max_error(), kGoal);
  EXPECT_TRUE(header.target().met());
  EXPECT_EQ(header.target().reason(), "");
  EXPECT_EQ(header.target().attempts_size(), 2);
  EXPECT_EQ(engine_.rendered(), 2);
  EXPECT_EQ(ReturnedOf(header), 1);
  EXPECT_FALSE(header.target().attempts(0).met());
  EXPECT_EQ(header.target().attempts(0).relative_rmse().value(), 1.3 * kGoal);
  ExpectOfReturned(header);
  std::vector<std::string> stages;
  for (const v1::StageTiming& timing : header.timings()) {
    stages.push_back(timing.stage());
  }
  EXPECT_THAT(stages,
              ::testing::ElementsAre("queue", "composite", "search", "error", "encode", "total"));
}

TEST_F(Search, MissIsSaidAndTheBestFrameReturned) {
  StartShowing(
      [](size_t n, const MeasureJob&) { return (1.5 + 0.1 * static_cast<double>(n)) * kGoal; });
  const v1::FrameHeader header = HeaderOf(TargetRequest());
  EXPECT_FALSE(header.target().met());
  EXPECT_NE(header.target().reason(), "");
  EXPECT_GT(header.target().attempts_size(), 1);
  EXPECT_EQ(ReturnedOf(header), 0);
  ExpectOfReturned(header);
}

TEST_F(Search, StraddlingIntervalIsMeasuredAgainWithMoreSamples) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_measure_error()->set_samples(100);
  request.mutable_measure_error()->set_seed(9);
  StartShowing({0.99 * kGoal, 0.9 * kGoal});
  engine_.PretendMilliseconds(1e6);
  const v1::FrameHeader header = HeaderOf(request);
  EXPECT_TRUE(header.target().met());
  EXPECT_EQ(header.target().attempts_size(), 1);
  ASSERT_EQ(jobs_.size(), 2U);
  EXPECT_EQ(jobs_[0].sample->samples, 100);
  EXPECT_GT(jobs_[1].sample->samples, 100);
  EXPECT_EQ(jobs_[1].sample->seed, 9U);
  EXPECT_EQ(header.error().milliseconds(), 0.002) << "both measurements";
  EXPECT_EQ(header.error().measurement().samples(), 100U) << "as asked for";
  ExpectOfReturned(header);
}

TEST_F(Search, KeepsMeasurementsWithinTheLimitOnTheirWork) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_scene()->mutable_camera()->set_width(1024);
  request.mutable_scene()->mutable_camera()->set_height(1024);
  request.mutable_measure_error()->set_samples(65536);
  // Two techniques scatter: once both have shown what a frame takes, none is cheaper than
  // measuring.
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.1F);
  ServerLimits limits;
  limits.max_reference_work = uint64_t{500} * 100000;
  StartShowing([](size_t, const MeasureJob& job) {
    return (job.sample->samples > 65536 ? 0.9 : 0.99) * kGoal;
  });
  engine_.PretendMilliseconds(1e6);
  ASSERT_TRUE(Submit(MustConvert(request, limits)).get().ok());
  ASSERT_GE(jobs_.size(), 2U);
  EXPECT_EQ(jobs_.front().sample->samples, 65536);
  EXPECT_EQ(jobs_.back().sample->samples, 100000);
}

TEST_F(Search, OfTimeAloneMeasuresNothing) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_target()->clear_max_error();
  request.mutable_target()->set_max_time_ms(100.0);
  StartShowing({1.0});
  const v1::FrameHeader header = HeaderOf(request);
  EXPECT_TRUE(header.target().met());
  EXPECT_TRUE(jobs_.empty());
  EXPECT_FALSE(header.has_error());
  EXPECT_FALSE(header.target().attempts(0).has_relative_rmse());
  EXPECT_EQ(header.target().attempts(0).milliseconds(), 0.25);
}

TEST_F(Search, OfTimeAloneMeasuresWhereThatIsAskedFor) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_target()->clear_max_error();
  request.mutable_target()->set_max_time_ms(100.0);
  request.mutable_measure_error()->set_samples(64);
  StartShowing({0.5});
  ExpectOfReturned(HeaderOf(request));
  ASSERT_FALSE(jobs_.empty());
  EXPECT_EQ(jobs_[0].sample->samples, 64);
}

TEST_F(Search, ImpossibleTimeIsAMissWithItsReason) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_target()->clear_max_error();
  request.mutable_target()->set_max_time_ms(1e-3);
  StartShowing({1.0});
  const v1::FrameHeader header = HeaderOf(request);
  EXPECT_FALSE(header.target().met());
  EXPECT_THAT(header.target().reason(), HasSubstr("ms of 0.001"));
  EXPECT_GE(ReturnedOf(header), 0);
}

// The sample of the first frame would do; all of its pixels do not.
TEST_F(Search, OutputOfTheErrorDecidesAndIsOfTheReturnedFrame) {
  v1::RenderFrameRequest request = TargetRequest();
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
  size_t maps = 0;
  StartShowing([&](size_t, const MeasureJob& job) {
    maps += job.map ? 1 : 0;
    return (maps == 1 && job.map ? 1.3 : 0.5) * kGoal;
  });
  const v1::FrameHeader header = HeaderOf(request);
  EXPECT_TRUE(header.target().met());
  EXPECT_EQ(header.target().attempts_size(), 2);
  EXPECT_EQ(header.target().attempts(0).relative_rmse().value(), 1.3 * kGoal);
  EXPECT_EQ(maps, 2U);
  EXPECT_EQ(header.error().sampled_pixels(), 3000U);
  EXPECT_EQ(header.outputs(2).channels_size(), 3);
  ExpectOfReturned(header);
}

TEST_F(Search, OutputOfTheErrorOfAMissIsMadeOnce) {
  v1::RenderFrameRequest request = TargetRequest();
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
  std::atomic<int> maps = 0;
  StartShowing([&](size_t, const MeasureJob& job) {
    maps += job.map ? 1 : 0;
    return 3.0 * kGoal;
  });
  const v1::FrameHeader header = HeaderOf(request);
  EXPECT_FALSE(header.target().met());
  EXPECT_EQ(maps, 1);
  EXPECT_EQ(header.error().sampled_pixels(), 3000U);
  ExpectOfReturned(header);
}

TEST_F(Search, OfScatteringComparesEachFrameWithoutAndWithItsSettings) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.5F);
  StartShowing({1.3 * kGoal, 0.5 * kGoal});
  const v1::FrameHeader header = HeaderOf(request);
  EXPECT_TRUE(header.target().met());
  EXPECT_EQ(engine_.rendered(), 2 * header.target().attempts_size());
  const Scene last = engine_.last_request().scene;
  EXPECT_FALSE(last.scatters());
  EXPECT_EQ(static_cast<uint32_t>(last.shadow.slices), header.metadata().shadow().slices());
  EXPECT_EQ(header.target().attempts(0).milliseconds(), 0.25) << "of the frame with scattering";
  EXPECT_EQ(header.error().compared(), v1::COMPARED_FRAME_WITHOUT_SCATTERING);
  ExpectOfReturned(header);
}

TEST_F(Search, OfScatteringForTimeAloneHasAMapAllTheSame) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.5F);
  request.mutable_target()->clear_max_error();
  request.mutable_target()->set_max_time_ms(1000.0);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
  std::atomic<int> maps = 0;
  Start({.encode = EncodePlain,
         .measure = [&](const Image& beauty, const Scene&, const MeasureJob& job,
                        const std::stop_token&) -> absl::StatusOr<FrameError> {
           maps += job.map ? 1 : 0;
           EXPECT_EQ(beauty.width, 64) << "the frame without scattering is there to be measured";
           return ErrorOf(0.5 * kGoal, job);
         }});
  const v1::FrameHeader header = HeaderOf(request);
  EXPECT_EQ(maps, 1);
  EXPECT_EQ(header.outputs_size(), 3);
  EXPECT_EQ(header.error().compared(), v1::COMPARED_FRAME_WITHOUT_SCATTERING);
}

TEST_F(Search, SecondFrameOfASequenceNeedsOneAttempt) {
  StartShowing({1.3 * kGoal, 0.5 * kGoal});
  const FrameJob first = MustConvert(TargetRequest());
  FrameJob second = MustConvert(TargetRequest());
  second.target->knowledge = first.target->knowledge;
  engine_.SetGate(false);
  auto one = Submit(first);
  auto two = Submit(second);
  ASSERT_TRUE(WaitFor([&] { return engine_.waiting() == 1; }));
  engine_.SetGate(true);
  EXPECT_EQ((*one.get())->header.target().attempts_size(), 2);
  const Result after = two.get();
  EXPECT_EQ((*after)->header.target().attempts_size(), 1);
  EXPECT_TRUE((*after)->header.target().met());
}

TEST_F(Search, FailureOfAFrameLetsTheNextOfItsSequenceBegin) {
  std::atomic<int> measured = 0;
  Start({.encode = EncodePlain,
         .measure = [&](const Image&, const Scene&, const MeasureJob& job,
                        const std::stop_token&) -> absl::StatusOr<FrameError> {
           if (measured++ == 0) {
             return absl::InternalError("out of luck");
           }
           return ErrorOf(0.5 * kGoal, job);
         }});
  const FrameJob first = MustConvert(TargetRequest());
  FrameJob second = MustConvert(TargetRequest());
  second.target->knowledge = first.target->knowledge;
  auto one = Submit(first);
  auto two = Submit(second);
  EXPECT_EQ(one.get().status().message(), "measuring the error: out of luck");
  EXPECT_TRUE(two.get().ok());
}

TEST_F(Search, IsCancelledInItsMiddleAndLetsTheNextBegin) {
  std::atomic<int> measured = 0;
  Start({.encode = EncodePlain,
         .measure = [&](const Image&, const Scene&, const MeasureJob& job,
                        const std::stop_token& stop) -> absl::StatusOr<FrameError> {
           if (measured++ == 1) {
             EXPECT_TRUE(WaitFor([&] { return stop.stop_requested(); }));
             return absl::CancelledError("stopped");
           }
           return ErrorOf((measured == 1 ? 1.3 : 0.5) * kGoal, job);
         }});
  const FrameJob first = MustConvert(TargetRequest());
  FrameJob second = MustConvert(TargetRequest());
  second.target->knowledge = first.target->knowledge;
  std::stop_source stop;
  auto one = Submit(first, stop.get_token());
  auto two = Submit(second);
  ASSERT_TRUE(WaitFor([&] { return measured == 2; }));
  stop.request_stop();
  EXPECT_EQ(one.get().status().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(two.get().ok());
}

TEST_F(Search, GoesOnThoughTheQueueIsFull) {
  std::atomic<int> measured = 0;
  Start({.admission = {.max_queued_frames = 1},
         .encode = EncodePlain,
         .measure = [&](const Image&, const Scene&, const MeasureJob& job,
                        const std::stop_token&) -> absl::StatusOr<FrameError> {
           const bool first = measured++ == 0;
           if (first) {
             EXPECT_EQ(Submit(MustConvert()).get().status().code(),
                       absl::StatusCode::kResourceExhausted);
           }
           return ErrorOf((first ? 1.3 : 0.5) * kGoal, job);
         }});
  const Result result = Submit(MustConvert(TargetRequest())).get();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE((*result)->header.target().met());
  EXPECT_GE(engine_.rendered(), 2);
}

TEST_F(Search, IsCancelledWhileItsNextPassWaits) {
  std::stop_source stop;
  Start({.encode = EncodePlain,
         .measure = [&](const Image&, const Scene&, const MeasureJob& job,
                        const std::stop_token&) -> absl::StatusOr<FrameError> {
           engine_.SetGate(false);
           return ErrorOf(1.3 * kGoal, job);
         }});
  auto frame = Submit(MustConvert(TargetRequest()), stop.get_token());
  ASSERT_TRUE(WaitFor([&] { return engine_.rendered() == 1 && engine_.waiting() == 1; }));
  stop.request_stop();
  EXPECT_EQ(frame.get().status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(engine_.rendered(), 1);
}

TEST_F(Search, EndOfTheEngineEndsTheFrame) {
  StartShowing({0.5 * kGoal});
  engine_.RefuseWith(absl::UnavailableError("the renderer is shutting down"));
  EXPECT_EQ(Submit(MustConvert(TargetRequest())).get().status().code(),
            absl::StatusCode::kUnavailable);
}

// Scattered light, which the reference has not, from among the particles, which slices cannot.
TEST_F(Search, SceneThatNoTechniqueCanDrawIsRefusedWithTheReasons) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.5F);
  v1::Light& light = *request.mutable_scene()->mutable_lighting()->mutable_lights(0);
  light.mutable_point()->mutable_position()->set_x(0.01);
  StartShowing({0.5 * kGoal});
  const Result result = Submit(MustConvert(request)).get();
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("target: "));
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("REFERENCE"));
}

TEST_F(Search, IsToldInTheImages) {
  std::mutex mutex;
  std::vector<std::pair<std::string, std::string>> text;
  Start({.encode =
             [&](const SharedImage& image, ImageKind kind, LightQuantity quantity,
                 const EncodeSettings& settings, const ImageMetadata& metadata) {
               const std::lock_guard lock(mutex);
               text = metadata.text;
               return EncodePlain(image, kind, quantity, settings, metadata);
             },
         .measure = [](const Image&, const Scene&, const MeasureJob& job, const std::stop_token&)
             -> absl::StatusOr<FrameError> { return ErrorOf(2.0 * kGoal, job); }});
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_target()->set_max_time_ms(50.0);
  ASSERT_TRUE(Submit(MustConvert(request)).get().ok());
  using Text = std::pair<std::string, std::string>;
  EXPECT_THAT(text, ::testing::IsSupersetOf({Text("halflight:target.met", "false"),
                                             Text("halflight:target.maxError", "0.25"),
                                             Text("halflight:target.maxTimeMs", "50")}));
}

TEST(FrameLog, TellsWhatBecameOfATarget) {
  MadeFrame frame;
  frame.target.emplace().attempts.resize(3);
  EXPECT_THAT(LogText("frame", FrameFields(MustConvert(), frame, absl::OkStatus())),
              HasSubstr("attempts=3 target_met=false outcome=OK"));
}

}  // namespace
}  // namespace halflight
