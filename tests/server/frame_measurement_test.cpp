// Measured frames on their way through the pipeline: what is compared with what, who is told, what
// fails and what is cancelled.

#include "server/frame_measurement.h"

#include <atomic>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "renderer/reference/evaluator.h"
#include "server/frame_log.h"
#include "tests/process/wait_for.h"
#include "tests/server/pipeline_fixture.h"

namespace halflight {
namespace {

using testing::BytesOf;
using testing::EncodePlain;
using testing::FakeImage;
using ::testing::HasSubstr;
using testing::MakeRequest;
using testing::MustConvert;
using testing::Result;
using testing::WaitFor;

v1::RenderFrameRequest MeasuredRequest() {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_measure_error();
  return request;
}

std::vector<std::string> StagesOf(const EncodedFrame& frame) {
  std::vector<std::string> stages;
  for (const v1::StageTiming& timing : frame.header.timings()) {
    stages.push_back(timing.stage());
  }
  return stages;
}

class Measurement : public testing::PipelineTest {
 protected:
  // Measures as the pipeline does, and notes what it was asked.
  void StartNoting() {
    Start({.encode = EncodePlain,
           .measure = [this](const Image& beauty, const Scene& scene, const MeasureJob& job,
                             const std::stop_token& stop) {
             const std::lock_guard lock(mutex_);
             compared_.push_back(beauty.pixels);
             threads_.insert(std::this_thread::get_id());
             return FrameMeasurer()(beauty, scene, job, stop);
           }});
  }

  std::mutex mutex_;
  std::vector<std::vector<float>> compared_;
  std::set<std::thread::id> threads_;
};

TEST_F(Measurement, ComparesTheBeautyAndTellsItInTheHeader) {
  StartNoting();
  v1::RenderFrameRequest request = MeasuredRequest();
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_DEPTH);
  const FrameJob job = MustConvert(request);
  const Result result = Submit(job).get();
  ASSERT_TRUE(result.ok()) << result.status();
  const Image beauty = FakeImage(job.request.scene, {ImageKind::kBeauty}, 1);
  ASSERT_EQ(compared_.size(), 1U);
  EXPECT_EQ(compared_[0], beauty.pixels);

  const v1::MeasuredError& error = (*result)->header.error();
  const auto direct = EstimateError(beauty, job.request.scene, *job.measure->sample);
  ASSERT_TRUE(direct.ok());
  EXPECT_EQ(error.compared(), v1::COMPARED_FRAME_RETURNED);
  EXPECT_EQ(error.sampled_pixels(), 1024U);
  EXPECT_EQ(error.relative_rmse().value(), direct->relative_rmse.value);
  EXPECT_GT(error.relative_rmse().low(), 0.0);
  EXPECT_THAT(StagesOf(**result),
              ::testing::ElementsAre("queue", "composite", "error", "encode", "total"));
  EXPECT_EQ((*result)->outputs.size(), 1U) << "the beauty was not asked for";
}

TEST_F(Measurement, IsMadeOnlyWhereItIsAskedForAndNeverByTheEngine) {
  StartNoting();
  std::thread::id engine;
  ASSERT_TRUE(engine_
                  .Submit({MustConvert().request.scene, {}}, {},
                          [&](const auto&) { engine = std::this_thread::get_id(); })
                  .ok());
  const Result plain = Submit(MustConvert()).get();
  EXPECT_FALSE((*plain)->header.has_error());
  EXPECT_TRUE(compared_.empty());
  ASSERT_TRUE(Submit(MustConvert(MeasuredRequest())).get().ok());
  EXPECT_EQ(threads_.size(), 1U);
  EXPECT_EQ(threads_.count(engine), 0U);
}

TEST_F(Measurement, OfScatteringIsOfASecondFrameWithout) {
  StartNoting();
  v1::RenderFrameRequest request = MeasuredRequest();
  request.mutable_scene()->mutable_shadow()->set_blur_mode(v1::BLUR_MODE_TEXELS_PER_SLICE);
  request.mutable_scene()->mutable_shadow()->set_blur_texels(2.0F);
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.5F);
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_DEPTH);
  const Result result = Submit(MustConvert(request)).get();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(engine_.rendered(), 2);
  const FrameRequest second = engine_.last_request();
  EXPECT_FALSE(second.scene.scatters());
  ASSERT_EQ(second.images.size(), 1U);
  EXPECT_EQ(second.images[0].kind, ImageKind::kBeauty);
  ASSERT_EQ(compared_.size(), 1U);
  EXPECT_EQ(compared_[0], FakeImage(second.scene, second.images[0], 0).pixels);
  const v1::FrameHeader& header = (*result)->header;
  EXPECT_EQ(header.error().compared(), v1::COMPARED_FRAME_WITHOUT_SCATTERING);
  EXPECT_EQ(header.metadata().shadow().blur_texels(), 2.0F) << "of the frame that is returned";
  EXPECT_EQ(header.plan().passes_size(), 1);
}

TEST_F(Measurement, OfPhysicalScatteringIsOfASecondFrameWithout) {
  StartNoting();
  v1::RenderFrameRequest request = MeasuredRequest();
  request.mutable_scene()->mutable_material()->mutable_physical_scattering()->set_mean_cosine(0.8F);
  const Result result = Submit(MustConvert(request)).get();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(engine_.rendered(), 2);
  EXPECT_FALSE(engine_.last_request().scene.scatters());
  EXPECT_EQ((*result)->header.error().compared(), v1::COMPARED_FRAME_WITHOUT_SCATTERING);
}

TEST_F(Measurement, OutputOfTheErrorHoldsFrameMinusModel) {
  StartNoting();
  v1::RenderFrameRequest request = MakeRequest();
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
  const FrameJob job = MustConvert(request);
  const Result result = Submit(job).get();
  ASSERT_TRUE(result.ok()) << result.status();
  const Image beauty = FakeImage(job.request.scene, {ImageKind::kBeauty}, 0);
  const auto exact = (*reference::Evaluator::Create(job.request.scene))->EvaluateWindow();
  Image expected{64, 48, 1, {"R", "G", "B"}, {}};
  for (size_t i = 0; i < exact->rgba.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      expected.pixels.push_back(static_cast<float>(
          static_cast<double>(beauty.pixels[4 * i + static_cast<size_t>(c)]) - exact->rgba[i][c]));
    }
  }
  const EncodedFrame& frame = **result;
  ASSERT_EQ(frame.outputs.size(), 2U);
  EXPECT_EQ(frame.outputs[0].view(), BytesOf(beauty));
  EXPECT_EQ(frame.outputs[1].view(), BytesOf(expected));
  EXPECT_EQ(frame.header.outputs(1).channels_size(), 3);
  // The model is known everywhere, so nothing is left to chance.
  const v1::MeasuredError& error = frame.header.error();
  EXPECT_FALSE(error.has_measurement());
  EXPECT_EQ(error.sampled_pixels(), error.covered_pixels());
  EXPECT_EQ(error.rmse().low(), error.rmse().high());
  EXPECT_GT(error.milliseconds(), 0.0);
}

TEST_F(Measurement, BesideAnOutputOfTheErrorEvaluatesTheModelOnce) {
  StartNoting();
  v1::RenderFrameRequest request = MeasuredRequest();
  request.mutable_measure_error()->set_samples(32);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
  const Result result = Submit(MustConvert(request)).get();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(compared_.size(), 1U);
  const v1::MeasuredError& error = (*result)->header.error();
  EXPECT_EQ(error.measurement().samples(), 32U);
  EXPECT_EQ(error.sampled_pixels(), error.covered_pixels());
}

TEST_F(Measurement, FailureIsTheFramesWithItsReason) {
  std::atomic<int> encoded = 0;
  Start({.encode =
             [&](const SharedImage& image, ImageKind kind, LightQuantity quantity,
                 const EncodeSettings& settings, const ImageMetadata& metadata) {
               ++encoded;
               return EncodePlain(image, kind, quantity, settings, metadata);
             },
         .measure = [](const Image&, const Scene&, const MeasureJob&, const std::stop_token&)
             -> absl::StatusOr<FrameError> { return absl::InternalError("out of luck"); }});
  const Result result = Submit(MustConvert(MeasuredRequest())).get();
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInternal);
  EXPECT_EQ(result.status().message(), "measuring the error: out of luck");
  EXPECT_EQ(encoded, 0);
  EXPECT_TRUE(Submit(MustConvert()).get().ok()) << "frames that are not measured are well";
}

TEST_F(Measurement, IsCancelledInItsMiddle) {
  std::atomic<bool> measuring = false;
  Start({.encode = EncodePlain,
         .measure = [&](const Image&, const Scene&, const MeasureJob&,
                        const std::stop_token& stop) -> absl::StatusOr<FrameError> {
           measuring = true;
           EXPECT_TRUE(WaitFor([&] { return stop.stop_requested(); }));
           return absl::CancelledError("stopped");
         }});
  std::stop_source stop;
  auto frame = Submit(MustConvert(MeasuredRequest()), stop.get_token());
  ASSERT_TRUE(WaitFor([&] { return measuring.load(); }));
  stop.request_stop();
  EXPECT_EQ(frame.get().status().code(), absl::StatusCode::kCancelled);
}

// Frames that wait for the measurer, which is held until it is released.
class WaitForMeasurement : public testing::PipelineTest {
 protected:
  void SetUp() override {
    Start({.encode = EncodePlain,
           .measure = [this, held = release_.get_future().share()](
                          const Image& beauty, const Scene& scene, const MeasureJob& job,
                          const std::stop_token& stop) {
             measured_.push_back(job.sample->seed);
             if (measured_.size() == 1) {
               begun_.set_value();
             }
             held.wait();
             return FrameMeasurer()(beauty, scene, job, stop);
           }});
    first_ = SubmitOf("a", 0);
    begun_.get_future().wait();
  }
  // A frame that is told from others by its seed.
  std::future<Result> SubmitOf(const std::string& tenant, uint64_t seed,
                               std::stop_token stop = {}) {
    v1::RenderFrameRequest request = MeasuredRequest();
    request.mutable_measure_error()->set_seed(seed);
    FrameJob job = MustConvert(request);
    job.caller.tenant = tenant;
    return Submit(std::move(job), std::move(stop));
  }
  // Until whatever was submitted waits: the engine hands over one frame after the other.
  void LetAllWait() { EXPECT_TRUE(Submit(MustConvert()).get().ok()); }

  std::promise<void> release_;
  std::promise<void> begun_;
  std::vector<uint64_t> measured_;  // their seeds, in order
  std::future<Result> first_;
};

TEST_F(WaitForMeasurement, IsFairBetweenClients) {
  std::vector<std::future<Result>> frames;
  for (const uint64_t seed : {1, 2, 3, 4}) {
    frames.push_back(SubmitOf("a", seed));
  }
  frames.push_back(SubmitOf("b", 5));
  LetAllWait();
  release_.set_value();
  for (auto& frame : frames) {
    EXPECT_TRUE(frame.get().ok());
  }
  EXPECT_THAT(measured_, ::testing::ElementsAre(0, 5, 1, 2, 3, 4));
}

TEST_F(WaitForMeasurement, EndsAtOnceWhereTheFrameIsCancelled) {
  std::stop_source stop;
  auto second = SubmitOf("a", 1, stop.get_token());
  LetAllWait();
  stop.request_stop();
  EXPECT_EQ(second.wait_for(std::chrono::seconds(10)), std::future_status::ready)
      << "it waited for the measurement before its own";
  EXPECT_EQ(pipeline_->queued(), 1U);
  release_.set_value();
  EXPECT_TRUE(first_.get().ok());
  EXPECT_EQ(second.get().status().code(), absl::StatusCode::kCancelled);
  EXPECT_THAT(measured_, ::testing::ElementsAre(0));
}

TEST_F(Measurement, WaitForItDoesNotCountAgainstAFrame) {
  std::atomic<bool> held = true;
  Start({.max_frame_time = std::chrono::milliseconds(300),
         .encode = EncodePlain,
         .measure = [&](const Image& beauty, const Scene& scene, const MeasureJob& job,
                        const std::stop_token& stop) {
           if (held.exchange(false)) {
             EXPECT_TRUE(WaitFor([&] { return stop.stop_requested(); }));
           }
           return FrameMeasurer()(beauty, scene, job, stop);
         }});
  auto first = Submit(MustConvert(MeasuredRequest()));
  auto second = Submit(MustConvert(MeasuredRequest()));
  EXPECT_EQ(first.get().status().code(), absl::StatusCode::kDeadlineExceeded);
  const Result result = second.get();
  EXPECT_TRUE(result.ok()) << result.status();
}

TEST_F(Measurement, HoldsUpNeitherRenderingNorFramesThatAreNotMeasured) {
  std::promise<void> release;
  Start({.encode = EncodePlain,
         .measure = [held = release.get_future().share()](const Image& beauty, const Scene& scene,
                                                          const MeasureJob& job,
                                                          const std::stop_token& stop) {
           held.wait();
           return FrameMeasurer()(beauty, scene, job, stop);
         }});
  auto measured = Submit(MustConvert(MeasuredRequest()));
  EXPECT_TRUE(Submit(MustConvert()).get().ok());
  release.set_value();
  EXPECT_TRUE(measured.get().ok());
}

TEST_F(Measurement, FailsWhereTheFrameToCompareIsNotRendered) {
  StartNoting();
  engine_.SetGate(false);
  v1::RenderFrameRequest request = MeasuredRequest();
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.5F);
  auto frame = Submit(MustConvert(request));
  // The first frame is in the queue already.
  engine_.RefuseWith(absl::UnavailableError("the renderer is shutting down"));
  engine_.SetGate(true);
  const Result result = frame.get();
  EXPECT_EQ(result.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("shutting down"));
}

TEST(FrameLog, TellsTheRelativeError) {
  MadeFrame frame;
  frame.rendered.timings = {{"total", 2.0}};
  frame.error.emplace().relative_rmse.value = 0.03125;
  EXPECT_THAT(LogText("frame", FrameFields(MustConvert(), frame, absl::OkStatus())),
              HasSubstr("total_ms=2 relative_rmse=0.03125 outcome=OK"));
}

}  // namespace
}  // namespace halflight
