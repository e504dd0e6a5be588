// The handlers without sockets: what they send, in which order, how much they hold, how they end.

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "halflight/crc32c.h"
#include "server/error_detail.h"
#include "server/handlers/find_missing_particles.h"
#include "server/handlers/get_server_info.h"
#include "server/handlers/query_upload.h"
#include "server/handlers/render_frame.h"
#include "server/handlers/render_sequence.h"
#include "server/handlers/upload_particles.h"
#include "server/particle_files.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/server/fake_engine.h"
#include "tests/server/on_disk.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using testing::EncodePlain;
using testing::FakeEngine;
using ::testing::HasSubstr;
using testing::MakeParticles;
using testing::MakeRequest;
using testing::OnDiskAlone;
using ::testing::StartsWith;
using testing::WaitFor;

// Collects what a handler writes. Answers each write only when Take is called, so that a test is a
// peer as slow as it likes; breaks the rules of the sink loudly.
template <typename Response>
class FakeSink : public DuplexSink<Response> {
 public:
  void Write(const OutgoingMessage<Response>& outgoing) override {
    Response message = outgoing.message;
    if (message.has_chunk()) {
      message.mutable_chunk()->set_data(std::string(outgoing.chunk_data.view()));
    }
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(finished_.has_value()) << "a write after Finish";
    EXPECT_FALSE(writing_) << "a write while another is under way";
    writing_ = true;
    written_.push_back(message);
    changed_.notify_all();
  }

  void Finish(const absl::Status& status) override {
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(finished_.has_value()) << "a second Finish";
    EXPECT_FALSE(writing_) << "Finish while a write is under way";
    finished_ = status;
    changed_.notify_all();
  }

  void Read() override {
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(finished_.has_value()) << "a read after Finish";
    ++reads_;
    changed_.notify_all();
  }

  // Waits for a write or the end; then the handler may be told of the write. False at the end.
  bool WaitForWrite() {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, std::chrono::seconds(10),
                                  [this] { return writing_ || finished_.has_value(); }));
    const bool wrote = writing_;
    writing_ = false;
    return wrote;
  }

  // The handler may end the call on another thread than the one that gave it the reason.
  absl::Status WaitForFinish() {
    EXPECT_TRUE(WaitFor([this] { return finished().has_value(); }));
    return finished().value_or(absl::UnknownError("not finished"));
  }

  [[nodiscard]] std::optional<absl::Status> finished() const {
    const std::lock_guard lock(mutex_);
    return finished_;
  }
  [[nodiscard]] int reads() const {
    const std::lock_guard lock(mutex_);
    return reads_;
  }
  [[nodiscard]] std::vector<Response> written() const {
    const std::lock_guard lock(mutex_);
    return written_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Response> written_;
  bool writing_ = false;
  int reads_ = 0;
  std::optional<absl::Status> finished_;
};

class Handlers : public ::testing::Test {
 protected:
  FakeEngine engine_;
  ServerLimits limits_;
  std::string version_ = "1.2.3";
  ParticleStore store_{1 << 20};
  ByteBudget upload_memory_{1 << 20};
  PartialUploads partial_uploads_{upload_memory_, {}};
  FramePipeline pipeline_{
      engine_,
      {.admission = {.max_queued_frames = 64}, .encode_threads = 2, .encode = EncodePlain}};
  Backend backend_{engine_.device(), limits_, version_, store_, partial_uploads_, pipeline_};
};

// A store whose only set was left on disk by an earlier server.
struct OnDisk {
  explicit OnDisk(const ServerLimits& limits) {
    const auto particles = BuildInlineParticles(MakeRequest().scene().inline_particles(), limits);
    sha256 = particles->sha256;
    (*ParticleFiles::Open(folder / "cache", limits))->Write(sha256, particles->set);
    store =
        std::make_unique<ParticleStore>(1 << 20, *ParticleFiles::Open(folder / "cache", limits));
    EXPECT_TRUE(OnDiskAlone(*store, sha256));
  }

  [[nodiscard]] v1::RenderFrameRequest Request() const {
    v1::RenderFrameRequest request = MakeRequest();
    request.mutable_scene()->set_particle_sha256(sha256);
    return request;
  }

  testing::Folder folder;
  std::string sha256;
  std::unique_ptr<ParticleStore> store;
};

TEST_F(Handlers, FrameWaitsForItsParticlesToBeReadFromDisk) {
  const OnDisk disk(limits_);
  const Backend backend{engine_.device(), limits_,          version_,
                        *disk.store,      partial_uploads_, pipeline_};
  FakeSink<v1::RenderFrameResponse> sink;
  const auto handler = std::make_shared<RenderFrameHandler>(backend, sink);
  handler->Start(disk.Request());
  while (sink.WaitForWrite()) {
    handler->OnWritten(true);
  }
  EXPECT_TRUE(sink.finished()->ok()) << *sink.finished();
  EXPECT_TRUE(sink.written().back().has_trailer());
}

TEST_F(Handlers, FrameCancelledWhileItsParticlesAreReadIsNotRendered) {
  const OnDisk disk(limits_);
  const Backend backend{engine_.device(), limits_,          version_,
                        *disk.store,      partial_uploads_, pipeline_};
  FakeSink<v1::RenderFrameResponse> sink;
  const auto handler = std::make_shared<RenderFrameHandler>(backend, sink);
  handler->OnCancel();
  handler->Start(disk.Request());
  EXPECT_EQ(sink.WaitForFinish().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(engine_.rendered(), 0);
}

TEST_F(Handlers, UploadThatCannotBeReadAnyMoreKeepsWhatCameBefore) {
  const v1::InlineParticles particles = MakeParticles(10, {v1::PARTICLE_ATTRIBUTE_POSITION});
  UploadParticlesHandler upload(backend_);
  ASSERT_FALSE(upload.OnRequest(testing::Header(testing::Describe(particles))).has_value());
  ASSERT_FALSE(upload.OnRequest(testing::Chunk(particles.payload().substr(0, 50))).has_value());
  EXPECT_EQ(upload.OnUnreadableRequest(absl::InvalidArgumentError("why")).status(),
            absl::InvalidArgumentError("why"));
  EXPECT_EQ(partial_uploads_.CommittedBytes(testing::Describe(particles).sha256()), 50U);
}

TEST_F(Handlers, QueryTellsHowMuchOfAnUploadIsThere) {
  const v1::InlineParticles particles = MakeParticles(10, {v1::PARTICLE_ATTRIBUTE_POSITION});
  const v1::ParticleSetDescription header = testing::Describe(particles);
  v1::QueryUploadRequest query;
  query.set_sha256(header.sha256());
  EXPECT_EQ(QueryUpload(backend_, query)->committed_bytes(), 0U);
  {
    UploadParticlesHandler upload(backend_);
    EXPECT_FALSE(upload.OnRequest(testing::Header(header)).has_value());
    EXPECT_FALSE(upload.OnRequest(testing::Chunk(particles.payload().substr(0, 50))).has_value());
    EXPECT_EQ(QueryUpload(backend_, query)->committed_bytes(), 0U) << "it is under way";
    EXPECT_FALSE(upload.OnEndOfRequests().ok());
  }
  EXPECT_EQ(QueryUpload(backend_, query)->committed_bytes(), 50U);
  EXPECT_FALSE(QueryUpload(backend_, query)->complete());
  UploadParticlesHandler upload(backend_);
  EXPECT_FALSE(upload.OnRequest(testing::Header(header, 50)).has_value());
  EXPECT_FALSE(upload.OnRequest(testing::Chunk(particles.payload().substr(50))).has_value());
  EXPECT_FALSE(upload.OnRequest(testing::Finish(header)).has_value());
  EXPECT_TRUE(upload.OnEndOfRequests().ok());
  EXPECT_TRUE(QueryUpload(backend_, query)->complete());
  query.set_sha256("short");
  EXPECT_EQ(QueryUpload(backend_, query).status().message(), "sha256: 5 bytes, allowed: 32 bytes");
}

TEST_F(Handlers, ServerInfoTellsDeviceLimitsAndWhatIsOffered) {
  const v1::GetServerInfoResponse info = GetServerInfo(backend_);
  EXPECT_EQ(info.server_version(), "1.2.3");
  EXPECT_EQ(info.gl_renderer(), "fake");
  EXPECT_EQ(info.techniques_size(), v1::ShadowTechnique_ARRAYSIZE - 1);
  EXPECT_EQ(info.output_kinds_size(), v1::OutputKind_ARRAYSIZE - 1);
  EXPECT_EQ(info.formats_size(), v1::ImageFormat_ARRAYSIZE - 1);
}

TEST_F(Handlers, FindMissingKeepsTheOrderAndChecksNames) {
  EXPECT_TRUE(store_.Insert(std::string(32, 'b'), std::make_shared<ParticleSet>()).ok());
  v1::FindMissingParticlesRequest request;
  for (const char name : {'c', 'b', 'a'}) {
    request.add_sha256(std::string(32, name));
  }
  const auto response = FindMissingParticles(backend_, request);
  ASSERT_TRUE(response.ok());
  ASSERT_EQ(response->missing_sha256_size(), 2);
  EXPECT_EQ(response->missing_sha256(0), std::string(32, 'c'));
  EXPECT_EQ(response->missing_sha256(1), std::string(32, 'a'));

  request.set_sha256(1, "short");
  EXPECT_THAT(std::string(FindMissingParticles(backend_, request).status().message()),
              HasSubstr("sha256[1]: 5 bytes, allowed: 32 bytes"));
  request.Clear();
  for (int i = 0; i < 1025; ++i) {
    request.add_sha256(std::string(32, 'x'));
  }
  EXPECT_EQ(FindMissingParticles(backend_, request).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(Handlers, UploadAnswersErrorsAtOnceAndSuccessAtTheEndOfTheStream) {
  UploadParticlesHandler bad(backend_);
  v1::UploadParticlesRequest chunk;
  chunk.set_chunk("abc");
  const auto answer = bad.OnRequest(chunk);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->status().code(), absl::StatusCode::kInvalidArgument);

  UploadParticlesHandler unfinished(backend_);
  EXPECT_EQ(unfinished.OnEndOfRequests().status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(Handlers, FrameArrivesAsHeaderChunksWithoutGapsAndTrailer) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_camera()->set_width(300);
  request.mutable_scene()->mutable_camera()->set_height(200);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_DEPTH);
  FakeSink<v1::RenderFrameResponse> sink;
  const auto handler = std::make_shared<RenderFrameHandler>(backend_, sink);
  handler->Start(request);
  while (sink.WaitForWrite()) {
    handler->OnWritten(true);
  }
  EXPECT_TRUE(sink.finished()->ok()) << *sink.finished();

  const auto messages = sink.written();
  ASSERT_GE(messages.size(), 3U);
  ASSERT_TRUE(messages.front().has_header());
  ASSERT_TRUE(messages.back().has_trailer());
  std::vector<std::string> outputs(2);
  uint32_t last_index = 0;
  for (size_t i = 1; i + 1 < messages.size(); ++i) {
    ASSERT_TRUE(messages[i].has_chunk());
    const v1::OutputChunk& chunk = messages[i].chunk();
    EXPECT_GE(chunk.output_index(), last_index);
    EXPECT_EQ(chunk.offset(), outputs.at(chunk.output_index()).size());
    EXPECT_LE(chunk.data().size(), 256U * 1024U);
    EXPECT_FALSE(chunk.data().empty());
    last_index = chunk.output_index();
    outputs[last_index] += chunk.data();
  }
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(outputs[i].size(), messages.front().header().outputs(i).byte_size());
    EXPECT_EQ(ExtendCrc32c(0, outputs[i]), messages.back().trailer().output_crc32c(i));
  }
}

TEST_F(Handlers, InvalidFrameIsRefusedWithoutRendering) {
  v1::RenderFrameRequest request = MakeRequest();
  request.clear_outputs();
  FakeSink<v1::RenderFrameResponse> sink;
  const auto handler = std::make_shared<RenderFrameHandler>(backend_, sink);
  handler->Start(request);
  ASSERT_TRUE(sink.finished().has_value());
  EXPECT_EQ(sink.finished()->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(engine_.rendered(), 0);
}

TEST_F(Handlers, WhereThereIsNoPlaceAFrameIsRefusedUnseenAndNothingIsReadForIt) {
  const OnDisk disk(limits_);
  FramePipeline full(
      engine_, {.admission = {.max_queued_frames = 1}, .encode_threads = 1, .encode = EncodePlain});
  const Backend backend{engine_.device(), limits_, version_, *disk.store, partial_uploads_, full};
  engine_.SetGate(false);
  FakeSink<v1::RenderFrameResponse> first_sink;
  const auto first = std::make_shared<RenderFrameHandler>(backend, first_sink);
  first->Start(MakeRequest());
  v1::RenderFrameRequest invalid = disk.Request();
  invalid.clear_outputs();
  for (const v1::RenderFrameRequest& request : {disk.Request(), invalid}) {
    FakeSink<v1::RenderFrameResponse> sink;
    std::make_shared<RenderFrameHandler>(backend, sink)->Start(request);
    ASSERT_TRUE(sink.finished().has_value()) << "at once";
    EXPECT_EQ(DetailOf(*sink.finished()).reason, v1::ERROR_REASON_QUEUE_FULL) << *sink.finished();
  }
  EXPECT_TRUE(OnDiskAlone(*disk.store, disk.sha256));
  engine_.SetGate(true);
  EXPECT_TRUE(first_sink.WaitForWrite());
  first->OnWritten(false);
}

TEST_F(Handlers, CancelledFrameEndsAsCancelled) {
  engine_.SetGate(false);
  FakeSink<v1::RenderFrameResponse> sink;
  const auto handler = std::make_shared<RenderFrameHandler>(backend_, sink);
  handler->Start(MakeRequest());
  handler->OnCancel();
  EXPECT_FALSE(sink.WaitForWrite());
  EXPECT_EQ(sink.finished()->code(), absl::StatusCode::kCancelled);
}

TEST_F(Handlers, PeerThatLeavesInTheMiddleEndsTheFrame) {
  FakeSink<v1::RenderFrameResponse> sink;
  const auto handler = std::make_shared<RenderFrameHandler>(backend_, sink);
  handler->Start(MakeRequest());
  ASSERT_TRUE(sink.WaitForWrite());
  handler->OnWritten(false);
  ASSERT_TRUE(sink.finished().has_value());
  EXPECT_EQ(sink.written().size(), 1U);
}

class Sequence : public Handlers {
 protected:
  static v1::RenderSequenceRequest Wrap(const v1::RenderFrameRequest& frame) {
    v1::RenderSequenceRequest request;
    *request.mutable_frame() = frame;
    return request;
  }

  // A request that changes nothing.
  static v1::RenderSequenceRequest Same(const std::string& id = "") {
    v1::RenderSequenceRequest request;
    request.mutable_frame()->set_request_id(id);
    return request;
  }

  // Plays a peer that sends these requests as they are asked for, and reads everything.
  void Play(const std::vector<v1::RenderSequenceRequest>& requests) {
    handler_->Start();
    std::jthread sender([&] {
      for (size_t i = 0; i <= requests.size(); ++i) {
        if (!WaitFor([&] {
              return sink_.reads() > static_cast<int>(i) || sink_.finished().has_value();
            }) ||
            sink_.finished().has_value()) {
          return;
        }
        if (i < requests.size()) {
          handler_->OnRequest(requests[i]);
        } else {
          handler_->OnEndOfRequests();
        }
      }
    });
    while (sink_.WaitForWrite()) {
      handler_->OnWritten(true);
    }
  }

  // The ids of the frames whose headers came, in order.
  std::vector<std::string> Ids() {
    std::vector<std::string> ids;
    for (const auto& message : sink_.written()) {
      if (message.has_header()) {
        ids.push_back(message.header().metadata().request_id());
      }
    }
    return ids;
  }

  FakeSink<v1::RenderSequenceResponse> sink_;
  std::shared_ptr<RenderSequenceHandler> handler_ =
      std::make_shared<RenderSequenceHandler>(backend_, sink_);
};

TEST_F(Sequence, FramesComeWholeAndInOrder) {
  std::vector<v1::RenderSequenceRequest> requests = {Wrap(MakeRequest())};
  for (int i = 1; i < 20; ++i) {
    requests.push_back(Same());
  }
  Play(requests);
  EXPECT_TRUE(sink_.finished()->ok()) << *sink_.finished();
  uint64_t frame = 0;
  bool inside = false;
  for (const auto& message : sink_.written()) {
    EXPECT_EQ(message.frame_index(), frame);
    EXPECT_EQ(message.has_header(), !inside);
    inside = !message.has_trailer();
    frame += message.has_trailer() ? 1 : 0;
  }
  EXPECT_EQ(frame, 20U);
}

TEST_F(Sequence, UnsetPartsAreThoseOfTheRequestBefore) {
  v1::RenderFrameRequest first = MakeRequest();
  first.mutable_scene()->mutable_shadow()->set_slices(7);
  v1::RenderFrameRequest second;
  second.mutable_scene()->mutable_camera()->mutable_look_at()->mutable_eye()->set_x(3.0);
  second.mutable_scene()->mutable_camera()->mutable_look_at()->mutable_target();
  v1::RenderFrameRequest third;
  *third.mutable_scene()->mutable_inline_particles() =
      MakeParticles(5, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS});
  third.add_outputs()->set_kind(v1::OUTPUT_KIND_COVERAGE);
  Play({Wrap(first), Wrap(second), Wrap(third), Same()});
  ASSERT_TRUE(sink_.finished()->ok()) << *sink_.finished();
  const FrameRequest last = engine_.last_request();
  EXPECT_EQ(last.scene.shadow.slices, 7);
  EXPECT_EQ(last.scene.particles->size(), 5U);
  EXPECT_EQ(last.scene.lights.size(), 1U);
  // A part replaces its predecessor as a whole: the size is that of an unset camera again.
  EXPECT_EQ(last.scene.camera.width, 640);
  EXPECT_EQ(last.scene.camera.view_from_world[3][2], -3.0);
  ASSERT_EQ(last.images.size(), 1U);
  EXPECT_EQ(last.images[0].kind, ImageKind::kCoverage);
}

TEST_F(Sequence, PriorityIsThatOfTheRequestItself) {
  SequenceState state(backend_);
  v1::RenderFrameRequest request = MakeRequest();
  request.set_priority(7);
  EXPECT_EQ(state.Next(request)->priority, 7);
  v1::RenderFrameRequest same;
  EXPECT_EQ(state.Next(same)->priority, 0);
  same.set_priority(101);
  EXPECT_THAT(std::string(state.Next(same).status().message()), HasSubstr("priority: 101"));
}

TEST_F(Sequence, FrameThatWaitsForAPlaceKeepsNoSetFromGoing) {
  FakeSink<v1::RenderSequenceResponse> sink;  // until nobody advances any more
  FramePipeline full(
      engine_, {.admission = {.max_queued_frames = 1}, .encode_threads = 1, .encode = EncodePlain});
  const Backend backend{engine_.device(), limits_, version_, store_, partial_uploads_, full};
  engine_.SetGate(false);
  const auto brought = BuildInlineParticles(MakeRequest().scene().inline_particles(), limits_);
  ASSERT_TRUE(store_.Insert(brought->sha256, brought->set).ok());
  v1::RenderSequenceRequest named;
  *named.mutable_frame() = MakeRequest();
  named.mutable_frame()->mutable_scene()->set_particle_sha256(brought->sha256);
  const auto handler = std::make_shared<RenderSequenceHandler>(backend, sink);
  handler->Start();
  handler->OnRequest(Wrap(MakeRequest()));
  ASSERT_TRUE(WaitFor([&] { return full.queued() == 1 && sink.reads() == 2; }));
  handler->OnRequest(named);
  EXPECT_EQ(brought->set.use_count(), 2) << "the store's and this test's";
  engine_.SetGate(true);
  for (int frames = 0; frames < 2;) {
    ASSERT_TRUE(sink.WaitForWrite());
    frames += sink.written().back().has_trailer() ? 1 : 0;
    handler->OnWritten(true);
  }
  EXPECT_EQ(engine_.last_request().scene.particles, brought->set);
  handler->OnEndOfRequests();
  EXPECT_TRUE(sink.WaitForFinish().ok());
}

TEST_F(Sequence, SetOfAFrameThatWaitsIsReadFromDiskWhereOthersPushedItOut) {
  FakeSink<v1::RenderSequenceResponse> sink;  // until nobody advances any more
  const OnDisk disk(limits_);
  FramePipeline full(
      engine_, {.admission = {.max_queued_frames = 1}, .encode_threads = 1, .encode = EncodePlain});
  const Backend backend{engine_.device(), limits_, version_, *disk.store, partial_uploads_, full};
  engine_.SetGate(false);
  const auto handler = std::make_shared<RenderSequenceHandler>(backend, sink);
  handler->Start();
  handler->OnRequest(Wrap(MakeRequest()));
  ASSERT_TRUE(WaitFor([&] { return full.queued() == 1 && sink.reads() == 2; }));
  handler->OnRequest(Wrap(disk.Request()));
  ASSERT_TRUE(WaitFor([&] { return disk.store->state().disk_reads == 1; }));
  auto others = std::make_shared<ParticleSet>();
  others->positions.resize((1 << 20) / 12);
  ASSERT_TRUE(WaitFor([&] { return disk.store->Insert("others", others).ok(); }));
  others.reset();
  ASSERT_TRUE(WaitFor([&] { return disk.store->idle(); }));
  ASSERT_TRUE(OnDiskAlone(*disk.store, disk.sha256));
  engine_.SetGate(true);
  for (int frames = 0; frames < 2;) {
    ASSERT_TRUE(sink.WaitForWrite()) << *sink.finished();
    frames += sink.written().back().has_trailer() ? 1 : 0;
    handler->OnWritten(true);
  }
  EXPECT_EQ(disk.store->state().disk_reads, 2U);
  EXPECT_EQ(disk.store->state().misses, 0U) << "it was there all the time";
  handler->OnEndOfRequests();
  EXPECT_TRUE(sink.WaitForFinish().ok());
}

// As in a moving one whose sets are large.
TEST_F(Sequence, FrameWhoseSetFindsNoRoomBesideThatOfTheFrameBeforeWaitsForIt) {
  FakeSink<v1::RenderSequenceResponse> sink;  // until nobody advances any more
  const testing::Folder folder;
  std::vector<v1::RenderFrameRequest> requests;
  for (const int particles : {50000, 50001}) {
    const auto built =
        BuildInlineParticles(MakeParticles(particles, {v1::PARTICLE_ATTRIBUTE_POSITION}), limits_);
    (*ParticleFiles::Open(folder / "cache", limits_))->Write(built->sha256, built->set);
    requests.push_back(MakeRequest());
    requests.back().mutable_scene()->set_particle_sha256(built->sha256);
    requests.back().mutable_scene()->mutable_material()->set_radius(0.1F);
  }
  ParticleStore store(1 << 20, *ParticleFiles::Open(folder / "cache", limits_));
  const Backend backend{engine_.device(), limits_, version_, store, partial_uploads_, pipeline_};
  engine_.SetGate(false);
  const auto handler = std::make_shared<RenderSequenceHandler>(backend, sink);
  handler->Start();
  handler->OnRequest(Wrap(requests[0]));
  ASSERT_TRUE(WaitFor([&] { return sink.reads() == 2; }));
  handler->OnRequest(Wrap(requests[1]));
  EXPECT_FALSE(sink.finished().has_value());
  EXPECT_EQ(store.state().disk_reads, 1U) << "there is no room for the other";
  // The engine of this test remembers its last request.
  ASSERT_TRUE(engine_.Submit({}, {}, [](const auto&) {}).ok());
  engine_.SetGate(true);
  ASSERT_TRUE(WaitFor([&] { return engine_.rendered() >= 2; }));
  for (int frames = 0; frames < 2;) {
    ASSERT_TRUE(sink.WaitForWrite()) << *sink.finished();
    frames += sink.written().back().has_trailer() ? 1 : 0;
    handler->OnWritten(true);
  }
  handler->OnEndOfRequests();
  EXPECT_TRUE(sink.WaitForFinish().ok()) << *sink.finished();
}

TEST_F(Sequence, ParticlesThatItCarriesCountUntilOthersTakeTheirPlace) {
  v1::RenderFrameRequest request = MakeRequest();
  v1::InlineParticles& particles = *request.mutable_scene()->mutable_inline_particles();
  particles = MakeParticles(50000, {v1::PARTICLE_ATTRIBUTE_POSITION});
  request.mutable_scene()->mutable_material()->set_radius(0.1F);
  {
    SequenceState one(backend_);
    SequenceState another(backend_);
    ASSERT_TRUE(one.Next(request).ok());
    EXPECT_EQ(upload_memory_.used(), 600000U);
    const auto refused = another.Next(request);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(DetailOf(refused.status()).reason, v1::ERROR_REASON_UPLOAD_MEMORY_FULL);
    EXPECT_TRUE(DetailOf(refused.status()).retry_after.has_value());
    particles = MakeParticles(10, {v1::PARTICLE_ATTRIBUTE_POSITION});
    EXPECT_TRUE(one.Next(request).ok());
    EXPECT_EQ(upload_memory_.used(), 120U);
  }
  EXPECT_EQ(upload_memory_.used(), 0U);
}

TEST_F(Sequence, MeasurementIsKeptUntilAnotherTakesItsPlace) {
  v1::RenderFrameRequest second;
  second.mutable_measure_error()->set_samples(64);
  v1::RenderFrameRequest fourth;
  fourth.mutable_measure_error()->set_seed(3);
  Play({Wrap(MakeRequest()), Wrap(second), Same(), Wrap(fourth)});
  ASSERT_TRUE(sink_.finished()->ok()) << *sink_.finished();
  std::vector<std::string> measurements;
  for (const v1::RenderSequenceResponse& message : sink_.written()) {
    if (message.has_header()) {
      measurements.push_back(message.header().error().measurement().ShortDebugString());
    }
  }
  EXPECT_THAT(measurements,
              ::testing::ElementsAre("", "samples: 64", "samples: 64", "samples: 1024 seed: 3"));
}

TEST_F(Sequence, TargetIsKeptUntilSettingsTakeItsPlaceAndTheOtherWayRound) {
  v1::RenderFrameRequest first = MakeRequest();
  first.mutable_scene()->mutable_shadow()->set_slices(7);
  v1::RenderFrameRequest target;
  target.mutable_target()->set_max_time_ms(1000.0);
  v1::RenderFrameRequest settings;
  settings.mutable_scene()->mutable_shadow()->set_slices(9);
  Play({Wrap(first), Wrap(target), Same(), Wrap(settings), Same(), Wrap(target)});
  ASSERT_TRUE(sink_.finished()->ok()) << *sink_.finished();
  std::vector<bool> has_target;
  std::vector<uint32_t> slices;
  for (const v1::RenderSequenceResponse& message : sink_.written()) {
    if (message.has_header()) {
      has_target.push_back(message.header().has_target());
      slices.push_back(message.header().metadata().shadow().slices());
    }
  }
  EXPECT_THAT(has_target, ::testing::ElementsAre(false, true, true, false, false, true));
  EXPECT_EQ(slices.at(0), 7U);
  EXPECT_EQ(slices.at(3), 9U);
  EXPECT_EQ(slices.at(4), 9U);
}

// Else whoever leaves streams open would fill the memory for good.
TEST_F(Sequence, StreamThatWaitsKeepsNoParticlesFromOthers) {
  ParticleStore small(2 * 16);
  Backend backend{engine_.device(), limits_, version_, small, partial_uploads_, pipeline_};
  const auto particles = BuildInlineParticles(MakeRequest().scene().inline_particles(), limits_);
  ASSERT_TRUE(small.Insert(particles->sha256, std::make_shared<ParticleSet>(*particles->set)).ok());
  handler_ = std::make_shared<RenderSequenceHandler>(backend, sink_);
  v1::RenderFrameRequest first = MakeRequest();
  first.mutable_scene()->set_particle_sha256(particles->sha256);
  handler_->Start();
  engine_.SetGate(false);
  handler_->OnRequest(Wrap(first));
  const std::string other(32, 'x');
  EXPECT_EQ(small.Insert(other, particles->set).code(), absl::StatusCode::kResourceExhausted)
      << "while its frame is drawn there is no room";
  // The engine of this test remembers its last request.
  ASSERT_TRUE(engine_.Submit({}, {}, [](const auto&) {}).ok());
  engine_.SetGate(true);
  ASSERT_TRUE(WaitFor([&] { return small.Insert(other, particles->set).ok(); }));
  handler_->OnRequest(Same());
  handler_->OnEndOfRequests();
  while (sink_.WaitForWrite()) {
    handler_->OnWritten(true);
  }
  EXPECT_EQ(sink_.finished()->code(), absl::StatusCode::kNotFound) << *sink_.finished();
  EXPECT_EQ(engine_.rendered(), 2) << "one of them of this test's own";
}

TEST_F(Sequence, EndsWhereItStandsWhenTheServerDrains) {
  handler_->Start();
  engine_.SetGate(false);
  handler_->OnRequest(Wrap(MakeRequest()));
  handler_->OnDrain();
  engine_.SetGate(true);
  while (sink_.WaitForWrite()) {
    handler_->OnWritten(true);
  }
  EXPECT_EQ(sink_.finished()->code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(DetailOf(*sink_.finished()).reason, v1::ERROR_REASON_DRAINING);
  EXPECT_TRUE(sink_.written().back().has_trailer()) << "what was accepted is sent";
}

TEST_F(Sequence, RequestsThatComeWhileTheServerDrainsAreRefused) {
  handler_->Start();
  engine_.SetGate(false);
  handler_->OnRequest(Wrap(MakeRequest()));
  handler_->OnDrain();
  handler_->OnRequest(Same());
  engine_.SetGate(true);
  while (sink_.WaitForWrite()) {
    handler_->OnWritten(true);
  }
  EXPECT_EQ(sink_.finished()->code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(engine_.rendered(), 1);
}

TEST_F(Sequence, DrainEndsOneThatWaitsForItsClient) {
  handler_->Start();
  handler_->OnDrain();
  EXPECT_EQ(sink_.WaitForFinish().code(), absl::StatusCode::kUnavailable);
}

TEST_F(Sequence, ParticlesOnDiskAreReadBeforeTheirFrames) {
  const OnDisk disk(limits_);
  Backend backend{engine_.device(), limits_, version_, *disk.store, partial_uploads_, pipeline_};
  handler_ = std::make_shared<RenderSequenceHandler>(backend, sink_);
  handler_->Start();
  handler_->OnRequest(Wrap(disk.Request()));
  ASSERT_TRUE(WaitFor([this] { return sink_.reads() == 2; })) << "it reads on once they are there";
  handler_->OnRequest(Same());
  handler_->OnEndOfRequests();
  while (sink_.WaitForWrite()) {
    handler_->OnWritten(true);
  }
  EXPECT_TRUE(sink_.finished()->ok()) << *sink_.finished();
  EXPECT_EQ(engine_.rendered(), 2);
}

TEST_F(Sequence, CancelledWhileItsParticlesAreReadEndsOnce) {
  const OnDisk disk(limits_);
  Backend backend{engine_.device(), limits_, version_, *disk.store, partial_uploads_, pipeline_};
  handler_ = std::make_shared<RenderSequenceHandler>(backend, sink_);
  engine_.SetGate(false);  // however late it is cancelled, nothing is written yet
  handler_->Start();
  handler_->OnRequest(Wrap(disk.Request()));
  handler_->OnCancel();
  EXPECT_EQ(sink_.WaitForFinish().code(), absl::StatusCode::kCancelled);
  engine_.SetGate(true);
}

TEST_F(Sequence, ErrorNamesItsFrameAfterAllFramesBeforeIt) {
  v1::RenderFrameRequest bad;
  bad.mutable_scene()->mutable_shadow()->set_slices(4000000000U);
  Play({Wrap(MakeRequest()), Same(), Wrap(bad), Same()});
  EXPECT_EQ(sink_.finished()->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(sink_.finished()->message()),
              StartsWith("frame 2: scene.shadow.slices: 4000000000"));
  EXPECT_EQ(Ids().size(), 2U);
  EXPECT_TRUE(sink_.written().back().has_trailer());
}

TEST_F(Sequence, UnreadableRequestEndsTheStreamAfterTheFramesBeforeIt) {
  handler_->Start();
  handler_->OnRequest(Wrap(MakeRequest()));
  ASSERT_TRUE(WaitFor([&] { return sink_.reads() == 2; }));
  handler_->OnUnreadableRequest(FieldError("message", "bytes that are none", "others"));
  while (sink_.WaitForWrite()) {
    handler_->OnWritten(true);
  }
  EXPECT_EQ(sink_.finished()->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(sink_.finished()->message()),
              StartsWith("frame 1: message: bytes that are none"));
  ASSERT_FALSE(sink_.written().empty());
  EXPECT_TRUE(sink_.written().back().has_trailer());
}

TEST_F(Sequence, FirstRequestMustBeComplete) {
  Play({Same()});
  EXPECT_THAT(std::string(sink_.finished()->message()),
              StartsWith("frame 0: scene.particles: unset"));
}

TEST_F(Sequence, EmptyStreamEndsWell) {
  Play({});
  EXPECT_TRUE(sink_.finished()->ok());
}

TEST_F(Sequence, FullQueueKeepsItsHint) {
  engine_.RefuseWith(absl::ResourceExhaustedError("full"));
  Play({Wrap(MakeRequest())});
  EXPECT_EQ(sink_.finished()->code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(DetailOf(*sink_.finished()).retry_after.has_value());
}

TEST_F(Sequence, SlowReaderStopsTheReadingAhead) {
  handler_->Start();
  handler_->OnRequest(Wrap(MakeRequest()));
  for (int i = 1; i < static_cast<int>(kFramesAhead); ++i) {
    ASSERT_EQ(sink_.reads(), i + 1);
    handler_->OnRequest(Same());
  }
  // All frames are rendered, the first header is being written, and the peer does not take it.
  ASSERT_TRUE(WaitFor([&] { return engine_.rendered() == static_cast<int>(kFramesAhead); }));
  EXPECT_EQ(sink_.reads(), static_cast<int>(kFramesAhead)) << "it asks for more than it may hold";
  // Once the first frame is through, it asks for one more.
  while (sink_.reads() == static_cast<int>(kFramesAhead)) {
    ASSERT_TRUE(sink_.WaitForWrite());
    handler_->OnWritten(true);
  }
  const auto written = sink_.written();
  EXPECT_TRUE(std::any_of(written.begin(), written.end(),
                          [](const auto& message) { return message.has_trailer(); }));
  handler_->OnEndOfRequests();
  while (sink_.WaitForWrite()) {
    handler_->OnWritten(true);
  }
  EXPECT_EQ(Ids().size(), kFramesAhead);
}

TEST_F(Sequence, CancellationStopsEverythingThatWaits) {
  engine_.SetGate(false);
  handler_->Start();
  handler_->OnRequest(Wrap(MakeRequest()));
  handler_->OnRequest(Same());
  handler_->OnCancel();
  EXPECT_EQ(sink_.WaitForFinish().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(WaitFor([&] { return engine_.waiting() == 0; }));
  EXPECT_EQ(engine_.rendered(), 0);
  // What arrives after the end is left alone.
  handler_->OnEndOfRequests();
}

TEST_F(Sequence, PeerThatLeavesDuringAWriteEndsTheStream) {
  handler_->Start();
  handler_->OnRequest(Wrap(MakeRequest()));
  ASSERT_TRUE(sink_.WaitForWrite());
  handler_->OnWritten(false);
  handler_->OnEndOfRequests();
  EXPECT_EQ(sink_.WaitForFinish().code(), absl::StatusCode::kCancelled);
}

TEST_F(Sequence, CancellationAtAnyMomentFinishesOnce) {
  for (int round = 0; round < 200; ++round) {
    FakeSink<v1::RenderSequenceResponse> sink;
    auto handler = std::make_shared<RenderSequenceHandler>(backend_, sink);
    handler->Start();
    handler->OnRequest(Wrap(MakeRequest()));
    std::jthread canceller([&, round] {
      std::this_thread::sleep_for(std::chrono::microseconds(5 * round));
      handler->OnCancel();
    });
    handler->OnRequest(Same());
    while (sink.WaitForWrite()) {
      handler->OnWritten(true);
    }
    EXPECT_EQ(sink.WaitForFinish().code(), absl::StatusCode::kCancelled);
  }
}

}  // namespace
}  // namespace halflight
