// The pipeline between engine and calls: complete frames, errors, bounds, cancellation, threads.

#include "server/frame_pipeline.h"

#include <atomic>
#include <future>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/error_detail.h"
#include "server/frame_log.h"
#include "tests/process/wait_for.h"
#include "tests/server/pipeline_fixture.h"

namespace halflight {
namespace {

using testing::BytesOf;
using ::testing::ElementsAre;
using testing::EncodePlain;
using testing::FakeImage;
using ::testing::HasSubstr;
using testing::MakeRequest;
using testing::MustConvert;
using testing::WaitFor;

using testing::Result;

class Pipeline : public testing::PipelineTest {};

TEST_F(Pipeline, FrameHoldsEveryOutputInOrder) {
  Start({.encode_threads = 3, .server_version = "1.2.3", .encode = EncodePlain});
  v1::RenderFrameRequest request = MakeRequest();
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_DEPTH);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_COVERAGE);
  const FrameJob job = MustConvert(request);
  const Result result = Submit(job).get();
  ASSERT_TRUE(result.ok()) << result.status();
  const EncodedFrame& frame = **result;
  ASSERT_EQ(frame.outputs.size(), 3U);
  for (size_t i = 0; i < 3; ++i) {
    const Image image = FakeImage(job.request.scene, job.request.images[i], i);
    EXPECT_EQ(frame.outputs[i].view(), BytesOf(image));
  }
  EXPECT_EQ(frame.header.metadata().server_version(), "1.2.3");
  EXPECT_EQ(frame.header.metadata().gl_renderer(), "fake");
  EXPECT_EQ(frame.header.plan().passes(0).name(), "pretend");
  EXPECT_EQ(frame.header.timings(0).stage(), "queue");
  EXPECT_EQ(frame.header.timings(1).stage(), "composite");
  EXPECT_EQ(frame.header.timings(2).stage(), "encode");
  EXPECT_EQ(frame.header.timings(3).stage(), "total");
}

TEST_F(Pipeline, MakesRequestIdsThatDiffer) {
  Start({.encode = EncodePlain});
  const Result first = Submit(MustConvert()).get();
  const Result second = Submit(MustConvert()).get();
  EXPECT_FALSE((*first)->header.metadata().request_id().empty());
  EXPECT_NE((*first)->header.metadata().request_id(), (*second)->header.metadata().request_id());
}

TEST_F(Pipeline, RawOutputsOfOneImageAreHeldOnceAndOnlyByTheFrame) {
  Start({});
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_outputs(0)->set_format(v1::IMAGE_FORMAT_RAW_FLOAT);
  *request.add_outputs() = request.outputs(0);
  const FrameJob job = MustConvert(request);
  Result result = Submit(job).get();
  ASSERT_TRUE(result.ok()) << result.status();
  const Image image = FakeImage(job.request.scene, job.request.images[0], 0);
  const std::vector<SharedBytes>& outputs = (*result)->outputs;
  ASSERT_EQ(outputs.size(), 2U);
  EXPECT_EQ(outputs[0].view(), BytesOf(image));
  EXPECT_EQ(outputs[0].view().data(), outputs[1].view().data());
  EXPECT_EQ((*result)->header.outputs(1).byte_size(), outputs[1].size());
  const std::weak_ptr<const void> pixels = outputs[0].owner();
  ASSERT_TRUE(WaitFor([&] { return result->use_count() == 1; })) << "the pipeline keeps the frame";
  result = nullptr;
  EXPECT_TRUE(pixels.expired());
}

TEST_F(Pipeline, EngineErrorsArriveAsTheyAre) {
  Start({.encode = EncodePlain});
  engine_.FailWith(absl::InvalidArgumentError("scene.lighting: nonsense"));
  const Result result = Submit(MustConvert()).get();
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(result.status().message(), "scene.lighting: nonsense");
}

TEST_F(Pipeline, EncodingErrorsNameTheOutput) {
  Start({.encode = [](const SharedImage& image, ImageKind kind, LightQuantity quantity,
                      const EncodeSettings& settings,
                      const ImageMetadata& metadata) -> absl::StatusOr<EncodedImage> {
    if (kind == ImageKind::kDepth) {
      return absl::InvalidArgumentError("too large for PNG");
    }
    return EncodePlain(image, kind, quantity, settings, metadata);
  }});
  v1::RenderFrameRequest request = MakeRequest();
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_DEPTH);
  const Result result = Submit(MustConvert(request)).get();
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(result.status().message(), "outputs[1]: too large for PNG");
}

TEST_F(Pipeline, RefusesWithAHintWhenFullAndTakesAgainAfterwards) {
  Start({.admission = {.max_queued_frames = 2}, .encode = EncodePlain});
  engine_.SetGate(false);
  auto first = Submit(MustConvert());
  auto second = Submit(MustConvert());
  const Result third = Submit(MustConvert()).get();
  EXPECT_EQ(third.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(DetailOf(third.status()).retry_after.has_value());
  engine_.SetGate(true);
  EXPECT_TRUE(first.get().ok());
  EXPECT_TRUE(second.get().ok());
  EXPECT_TRUE(Submit(MustConvert()).get().ok());
}

TEST_F(Pipeline, FramesThatWaitForTheEncoderCountAsQueued) {
  std::promise<void> release;
  Start({.admission = {.max_queued_frames = 1},
         .encode = [held = release.get_future().share()](
                       const SharedImage& image, ImageKind kind, LightQuantity quantity,
                       const EncodeSettings& settings, const ImageMetadata& metadata) {
           held.wait();
           return EncodePlain(image, kind, quantity, settings, metadata);
         }});
  auto first = Submit(MustConvert());
  ASSERT_TRUE(WaitFor([&] { return engine_.rendered() == 1; }));
  EXPECT_EQ(Submit(MustConvert()).get().status().code(), absl::StatusCode::kResourceExhausted);
  release.set_value();
  EXPECT_TRUE(first.get().ok());
}

TEST_F(Pipeline, ClientBeyondItsShareIsRefusedAndOthersAreNot) {
  Start({.admission = {.max_queued_frames = 4, .max_client_frames = 2}, .encode = EncodePlain});
  engine_.SetGate(false);
  FrameJob job = MustConvert();
  job.caller.tenant = "greedy";
  auto first = Submit(job);
  auto second = Submit(job);
  const Result third = Submit(job).get();
  EXPECT_EQ(third.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(DetailOf(third.status()).reason, v1::ERROR_REASON_CLIENT_QUEUE_FULL);
  EXPECT_TRUE(DetailOf(third.status()).retry_after.has_value());
  job.caller.tenant = "other";
  auto other = Submit(job);
  engine_.SetGate(true);
  EXPECT_TRUE(first.get().ok());
  EXPECT_TRUE(second.get().ok());
  EXPECT_TRUE(other.get().ok());
  job.caller.tenant = "greedy";
  EXPECT_TRUE(Submit(job).get().ok());
}

TEST_F(Pipeline, MemoryOfAFrameIsHeldUntilItIsLetGo) {
  const FrameJob job = MustConvert();
  Start({.admission = {.max_frame_bytes = job.pixel_bytes * 3 / 2}, .encode = EncodePlain});
  Result first = Submit(job).get();
  ASSERT_TRUE(first.ok());
  const Result refused = Submit(job).get();
  EXPECT_EQ(DetailOf(refused.status()).reason, v1::ERROR_REASON_FRAME_MEMORY_FULL);
  EXPECT_TRUE(DetailOf(refused.status()).retry_after.has_value());
  *first = nullptr;
  EXPECT_TRUE(Submit(job).get().ok());
}

TEST_F(Pipeline, ClientThatKeepsItsFramesTakesNobodyElsesMemory) {
  FrameJob job = MustConvert();
  Start({.admission = {.max_frame_bytes = job.pixel_bytes * 3,
                       .max_client_frame_bytes = job.pixel_bytes * 3 / 2},
         .encode = EncodePlain});
  job.caller.tenant = "slow reader";
  Result first = Submit(job).get();
  ASSERT_TRUE(first.ok());
  const Result refused = Submit(job).get();
  EXPECT_EQ(DetailOf(refused.status()).reason, v1::ERROR_REASON_FRAME_MEMORY_FULL);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("of one client"));
  EXPECT_TRUE(DetailOf(refused.status()).retry_after.has_value());
  FrameJob others = job;
  others.caller.tenant = "other";
  EXPECT_TRUE(Submit(others).get().ok());
  *first = nullptr;
  EXPECT_TRUE(Submit(job).get().ok());
}

TEST_F(Pipeline, FrameThatTakesMoreThanThereIsComesAlone) {
  const FrameJob job = MustConvert();
  Start({.admission = {.max_frame_bytes = job.pixel_bytes / 2}, .encode = EncodePlain});
  engine_.SetGate(false);
  auto first = Submit(job);
  EXPECT_EQ(DetailOf(Submit(job).get().status()).reason, v1::ERROR_REASON_FRAME_MEMORY_FULL);
  engine_.SetGate(true);
  EXPECT_TRUE(first.get().ok());
}

TEST_F(Pipeline, ClientsFramesPinSoMuchOfTheirSetsAndLeaveRoomForOthers) {
  FrameJob job = MustConvert();
  const uint64_t bytes = MemoryBytes(*job.request.scene.particles);
  ASSERT_GT(bytes, 0U);
  Start({.admission = {.max_client_set_bytes = 2 * bytes}, .encode = EncodePlain});
  engine_.SetGate(false);
  std::map<std::string, std::shared_ptr<const ParticleSet>> sets;
  for (const char* name : {"a", "b", "c", "d"}) {
    sets[name] = std::make_shared<ParticleSet>(*job.request.scene.particles);
  }
  const auto frame_of = [&](const std::string& tenant, const std::string& set) {
    job.caller.tenant = tenant;
    job.request.scene.particles = sets.at(set);
    return Submit(job);
  };
  std::vector<std::future<Result>> let_in;
  for (const char* set : {"a", "b", "b", "a"}) {
    let_in.push_back(frame_of("greedy", set));
  }
  const Result refused = frame_of("greedy", "c").get();
  EXPECT_EQ(DetailOf(refused.status()).reason, v1::ERROR_REASON_CACHE_FULL);
  EXPECT_TRUE(DetailOf(refused.status()).retry_after.has_value());
  let_in.push_back(frame_of("other", "c"));
  engine_.SetGate(true);
  for (auto& frame : let_in) {
    EXPECT_TRUE(frame.get().ok());
  }
  EXPECT_TRUE(frame_of("greedy", "c").get().ok());
  EXPECT_TRUE(frame_of("greedy", "d").get().ok());
}

TEST_F(Pipeline, EncodedFrameCountsWithItsBytesAlone) {
  const FrameJob job = MustConvert();
  Start({.admission = {.max_frame_bytes = job.pixel_bytes * 3 / 2},
         .encode = [](const SharedImage&, ImageKind, LightQuantity, const EncodeSettings&,
                      const ImageMetadata&) -> absl::StatusOr<EncodedImage> {
           return EncodedImage{.bytes = SharedBytes(std::string("small")),
                               .media_type = "test/plain",
                               .white_black = {}};
         }});
  const Result first = Submit(job).get();
  ASSERT_TRUE(first.ok());
  EXPECT_TRUE(Submit(job).get().ok());
}

TEST_F(Pipeline, FrameThatTakesTooLongIsEndedAndSaidSo) {
  Start({.max_frame_time = std::chrono::milliseconds(20), .encode = EncodePlain});
  engine_.SetGate(false);
  const Result late = Submit(MustConvert()).get();
  EXPECT_EQ(late.status().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(DetailOf(late.status()).reason, v1::ERROR_REASON_FRAME_TIME_EXCEEDED);
  EXPECT_EQ(DetailOf(late.status()).allowed, "at most 0.02 s");
  engine_.SetGate(true);
  EXPECT_TRUE(Submit(MustConvert()).get().ok());
}

TEST_F(Pipeline, TimeInTheQueueDoesNotCountAgainstAFrame) {
  Start({.max_frame_time = std::chrono::milliseconds(300), .encode = EncodePlain});
  engine_.SetGate(false);
  auto first = Submit(MustConvert());
  auto second = Submit(MustConvert());
  EXPECT_EQ(first.get().status().code(), absl::StatusCode::kDeadlineExceeded);
  engine_.SetGate(true);
  EXPECT_TRUE(second.get().ok());
}

TEST_F(Pipeline, CancelledInTheQueueDoesNotWaitForTheFrameBeforeIt) {
  Start({.encode = EncodePlain});
  engine_.SetGate(false);
  auto first = Submit(MustConvert());
  std::stop_source stop;
  auto second = Submit(MustConvert(), stop.get_token());
  stop.request_stop();
  EXPECT_EQ(second.get().status().code(), absl::StatusCode::kCancelled);
  engine_.SetGate(true);
  EXPECT_TRUE(first.get().ok());
}

TEST_F(Pipeline, EncodingDoesNotHoldUpRendering) {
  std::promise<void> release;
  Start({.encode_threads = 1,
         .encode = [held = release.get_future().share()](
                       const SharedImage& image, ImageKind kind, LightQuantity quantity,
                       const EncodeSettings& settings, const ImageMetadata& metadata) {
           held.wait();
           return EncodePlain(image, kind, quantity, settings, metadata);
         }});
  auto first = Submit(MustConvert());
  auto second = Submit(MustConvert());
  auto third = Submit(MustConvert());
  EXPECT_TRUE(WaitFor([&] { return engine_.rendered() == 3; }));
  release.set_value();
  EXPECT_TRUE(first.get().ok());
  EXPECT_TRUE(second.get().ok());
  EXPECT_TRUE(third.get().ok());
}

// Holds every encoding until the promise is kept, and notes whose it is by the frame's width.
struct HeldEncoding {
  std::promise<void> release;
  std::mutex mutex;
  std::vector<int> widths;

  [[nodiscard]] auto Encode() {
    return [this, held = release.get_future().share()](
               const SharedImage& image, ImageKind kind, LightQuantity quantity,
               const EncodeSettings& settings, const ImageMetadata& metadata) {
      {
        const std::lock_guard lock(mutex);
        widths.push_back(image->width);
      }
      held.wait();
      return EncodePlain(image, kind, quantity, settings, metadata);
    };
  }
  [[nodiscard]] size_t begun() {
    const std::lock_guard lock(mutex);
    return widths.size();
  }
};

FrameJob JobOf(const std::string& tenant, uint32_t width) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_camera()->set_width(width);
  FrameJob job = MustConvert(request);
  job.caller.tenant = tenant;
  return job;
}

TEST_F(Pipeline, EncodingOfAnotherClientIsNotLast) {
  HeldEncoding encoding;
  Start({.encode_threads = 1, .encode = encoding.Encode()});
  std::vector<std::future<Result>> frames;
  for (const uint32_t width : {10U, 11U, 12U}) {
    frames.push_back(Submit(JobOf("greedy", width)));
  }
  EXPECT_TRUE(WaitFor([&] { return engine_.rendered() == 3 && encoding.begun() == 1; }));
  frames.push_back(Submit(JobOf("other", 20)));
  EXPECT_TRUE(WaitFor([&] { return engine_.rendered() == 4; }));
  encoding.release.set_value();
  for (auto& frame : frames) {
    EXPECT_TRUE(frame.get().ok());
  }
  EXPECT_THAT(encoding.widths, ElementsAre(10, 20, 11, 12));
}

TEST_F(Pipeline, CancelledWhileItWaitsForTheEncoderEndsAtOnceAndFreesItsPlace) {
  HeldEncoding encoding;
  Start({.admission = {.max_queued_frames = 2}, .encode_threads = 1, .encode = encoding.Encode()});
  auto first = Submit(MustConvert());
  std::stop_source stop;
  auto second = Submit(MustConvert(), stop.get_token());
  EXPECT_TRUE(WaitFor([&] { return engine_.rendered() == 2 && encoding.begun() == 1; }));
  stop.request_stop();
  EXPECT_EQ(second.get().status().code(), absl::StatusCode::kCancelled);
  auto third = Submit(MustConvert());
  encoding.release.set_value();
  EXPECT_TRUE(first.get().ok());
  EXPECT_TRUE(third.get().ok());
}

TEST_F(Pipeline, WaitingForTheEncoderDoesNotCountAgainstAFrame) {
  HeldEncoding encoding;
  Start({.max_frame_time = std::chrono::milliseconds(300),
         .encode_threads = 1,
         .encode = encoding.Encode()});
  auto first = Submit(MustConvert());
  EXPECT_TRUE(WaitFor([&] { return encoding.begun() == 1; }));
  auto second = Submit(MustConvert());
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  encoding.release.set_value();
  EXPECT_TRUE(second.get().ok());
  first.wait();
}

TEST_F(Pipeline, CancelledFrameIsDroppedBeforeItIsRendered) {
  Start({.encode = EncodePlain});
  engine_.SetGate(false);
  std::stop_source stop;
  auto frame = Submit(MustConvert(), stop.get_token());
  stop.request_stop();
  EXPECT_EQ(frame.get().status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(engine_.rendered(), 0);
}

TEST_F(Pipeline, CancelledFrameIsNotEncoded) {
  std::atomic<int> encoded = 0;
  std::stop_source stop;
  Start({.encode_threads = 1,
         .encode = [&](const SharedImage& image, ImageKind kind, LightQuantity quantity,
                       const EncodeSettings& settings, const ImageMetadata& metadata) {
           ++encoded;
           stop.request_stop();
           return EncodePlain(image, kind, quantity, settings, metadata);
         }});
  v1::RenderFrameRequest request = MakeRequest();
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_DEPTH);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_COVERAGE);
  const Result result = Submit(MustConvert(request), stop.get_token()).get();
  EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(encoded, 1) << "the outputs after the cancellation were encoded";
}

TEST_F(Pipeline, RefusalOfTheEngineLeavesRoomForTheNext) {
  Start({.admission = {.max_queued_frames = 1}, .encode = EncodePlain});
  engine_.RefuseWith(absl::ResourceExhaustedError("full"));
  const Result refused = Submit(MustConvert()).get();
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(DetailOf(refused.status()).retry_after.has_value());
  engine_.RefuseWith(absl::OkStatus());
  EXPECT_TRUE(Submit(MustConvert()).get().ok());
}

TEST_F(Pipeline, EndWaitsForWhatWasAccepted) {
  Start({.encode = EncodePlain});
  engine_.SetGate(false);
  auto frame = Submit(MustConvert());
  std::jthread opener([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    engine_.SetGate(true);
  });
  pipeline_.reset();
  EXPECT_EQ(frame.wait_for(std::chrono::seconds(0)), std::future_status::ready);
}

TEST(FrameLog, IsOneLineOfKeysWhateverTheClientSends) {
  FrameJob job = MustConvert();
  job.request_id = "a \"b\" \\";
  MadeFrame frame;
  frame.rendered.timings = {{"light sweep", 1.5}, {"total", 2.0}};
  job.caller = {.tenant = "b", .peer = "ipv4:1.2.3.4:5", .call_id = "c"};
  const std::string line =
      LogText("frame", FrameFields(job, frame, absl::InternalError("two\nlines")));
  EXPECT_THAT(line, HasSubstr(R"(request_id="a \"b\" \\")"));
  EXPECT_THAT(line, HasSubstr(" call_id=c tenant=b peer=ipv4:1.2.3.4:5 technique="));
  EXPECT_THAT(line, HasSubstr("technique=SHADOW_TECHNIQUE_HALF_ANGLE particles=2 size=64x48"));
  EXPECT_THAT(line, HasSubstr("light_sweep_ms=1.5 total_ms=2 outcome=INTERNAL"));
  EXPECT_THAT(line, HasSubstr(R"(message="two\nlines")"));
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace halflight
