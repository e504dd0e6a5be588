// What Prometheus gets of a halflightd that is used well and badly: every figure is known.

#include <chrono>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/metrics/observed_daemon.h"
#include "tests/server/fake_engine.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using grpc::StatusCode;
using testing::CallEnd;
using testing::Chunk;
using testing::Describe;
using testing::Finish;
using testing::Header;
using testing::MakeRequest;
using testing::MetricsPage;
using testing::TestCaller;

class Scraped : public testing::ObservedDaemon {};

TEST_F(Scraped, FramesThatAreMade) {
  Start({});
  TestCaller alice = Alice();
  const v1::RenderFrameRequest request = MakeRequest();
  uint64_t received = 0;
  for (int i = 0; i < 3; ++i) {
    const CallEnd end = alice.Render(request);
    ASSERT_TRUE(end.status.ok()) << end.status.error_message();
    received += end.received_bytes;
  }
  // A call is counted when it is over for the server, a moment after the client knows.
  ASSERT_TRUE(Becomes(R"(halflight_calls_total{code="OK",rpc="RenderFrame"})", 3.0));
  ASSERT_TRUE(Becomes(R"(halflight_calls_in_progress{rpc="RenderFrame"})", 0.0));
  const MetricsPage page = Page();
  EXPECT_EQ(page[R"(halflight_frames_total{outcome="OK",technique="half_angle",tenant="alice"})"],
            3.0);
  EXPECT_EQ(page.Sum("halflight_frames_total"), 3.0);
  for (const char* stage : {"queue", "composite", "encode", "send", "total"}) {
    EXPECT_EQ(page["halflight_frame_stage_seconds_count{stage=\"" + std::string(stage) + "\"}"],
              3.0)
        << stage;
  }
  // As the engine pretends.
  EXPECT_DOUBLE_EQ(page[R"(halflight_frame_stage_seconds_sum{stage="composite"})"], 3 * 0.00025);
  EXPECT_EQ(page[R"(halflight_sent_bytes_total{rpc="RenderFrame"})"],
            static_cast<double>(received));
  EXPECT_EQ(page[R"(halflight_received_bytes_total{rpc="RenderFrame"})"],
            static_cast<double>(3 * request.ByteSizeLong()));
  EXPECT_EQ(page.Sum("halflight_errors_total"), 0.0);
  EXPECT_EQ(page.Sum("halflight_cancellations_total"), 0.0);
  EXPECT_EQ(page.Sum("halflight_calls_in_progress"), 0.0);
  EXPECT_EQ(page["halflight_frames_in_progress"], 0.0);
  EXPECT_EQ(page["halflight_frame_memory_bytes"], 0.0);
  EXPECT_EQ(page["halflight_connections_refused_total"], 0.0);
  EXPECT_EQ(page["halflight_serving"], 1.0);
}

TEST_F(Scraped, FramesThatWaitAreCancelledLateOrRefused) {
  Start({"--max-queued-frames", "2"});
  Hold();
  TestCaller alice = Alice();
  TestCaller bob = Bob();
  // One in the engine, one behind it.
  grpc::ClientContext first_context;
  alice.Prepare(first_context);
  const auto first = alice.stub().RenderFrame(&first_context, MakeRequest());
  ASSERT_TRUE(Becomes("halflight_frames_in_progress", 1.0));
  grpc::ClientContext second_context;
  bob.Prepare(second_context);
  const auto second = bob.stub().RenderFrame(&second_context, MakeRequest());
  ASSERT_TRUE(Becomes("halflight_frames_in_progress", 2.0));
  EXPECT_EQ(Page()["halflight_frames_queued"], 1.0);
  EXPECT_EQ(Page()[R"(halflight_calls_in_progress{rpc="RenderFrame"})"], 2.0);
  // No room for a third.
  EXPECT_EQ(bob.Render(MakeRequest()).status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  // The one that waits is cancelled, and its place taken by one that has not enough time.
  second_context.TryCancel();
  EXPECT_EQ(TestCaller::Finish(second_context, *second).status.error_code(), StatusCode::CANCELLED);
  ASSERT_TRUE(Becomes("halflight_frames_in_progress", 1.0));
  grpc::ClientContext late_context;
  bob.Prepare(late_context);
  late_context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(300));
  EXPECT_EQ(TestCaller::Finish(late_context, *bob.stub().RenderFrame(&late_context, MakeRequest()))
                .status.error_code(),
            StatusCode::DEADLINE_EXCEEDED);
  ASSERT_TRUE(Becomes("halflight_frames_in_progress", 1.0));
  LetGo();
  EXPECT_TRUE(TestCaller::Finish(first_context, *first).status.ok());
  // What can never work, and who does not belong.
  v1::RenderFrameRequest wrong = MakeRequest();
  wrong.mutable_scene()->mutable_camera()->mutable_perspective()->set_vertical_fov_deg(200);
  EXPECT_EQ(alice.Render(wrong).status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Stranger().Render(MakeRequest()).status.error_code(), StatusCode::UNAUTHENTICATED);

  ASSERT_TRUE(testing::WaitFor([&] { return Page().Sum("halflight_calls_in_progress") == 0.0; }));
  const MetricsPage page = Page();
  const auto frames = [&](const std::string& outcome, const std::string& technique,
                          const std::string& tenant) {
    return page["halflight_frames_total{outcome=\"" + outcome + "\",technique=\"" + technique +
                "\",tenant=\"" + tenant + "\"}"];
  };
  EXPECT_EQ(frames("OK", "half_angle", "alice"), 1.0);
  EXPECT_EQ(frames("CANCELLED", "half_angle", "bob"), 2.0);
  EXPECT_EQ(frames("RESOURCE_EXHAUSTED", "none", "bob"), 1.0);
  EXPECT_EQ(frames("INVALID_ARGUMENT", "none", "alice"), 1.0);
  EXPECT_EQ(page.Sum("halflight_frames_total"), 5.0);
  EXPECT_EQ(page[R"(halflight_cancellations_total{by="client"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_cancellations_total{by="deadline"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_cancellations_total{by="stall"})"], 0.0);
  const auto errors = [&](const std::string& code, const std::string& reason) {
    return page["halflight_errors_total{code=\"" + code + "\",reason=\"" + reason + "\"}"];
  };
  EXPECT_EQ(errors("RESOURCE_EXHAUSTED", "QUEUE_FULL"), 1.0);
  EXPECT_EQ(errors("INVALID_ARGUMENT", "INVALID_FIELD"), 1.0);
  EXPECT_EQ(errors("UNAUTHENTICATED", "UNAUTHENTICATED"), 1.0);
  EXPECT_EQ(errors("CANCELLED", "UNSPECIFIED"), 1.0);
  EXPECT_EQ(errors("DEADLINE_EXCEEDED", "UNSPECIFIED"), 1.0);
  EXPECT_EQ(page.Sum("halflight_errors_total"), 5.0);
  EXPECT_EQ(page.Sum("halflight_calls_total"), 6.0);
  EXPECT_EQ(page[R"(halflight_frame_stage_seconds_count{stage="send"})"], 1.0);
}

TEST_F(Scraped, UploadsAndTheCache) {
  Start({"--cache-dir", folder_ / "cache"});
  TestCaller alice = Alice();
  const v1::InlineParticles set = testing::MakeParticles(
      1000, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS});
  const v1::ParticleSetDescription header = Describe(set);
  const std::string half = set.payload().substr(0, 8000);
  v1::FindMissingParticlesRequest question;
  question.add_sha256(header.sha256());
  question.add_sha256(std::string(32, 'x'));
  v1::RenderFrameRequest frame = MakeRequest();
  frame.mutable_scene()->set_particle_sha256(header.sha256());
  const auto ask = [&] {
    grpc::ClientContext context;
    alice.Prepare(context);
    v1::FindMissingParticlesResponse missing;
    EXPECT_TRUE(alice.stub().FindMissingParticles(&context, question, &missing).ok());
    grpc::ClientContext other_context;
    alice.Prepare(other_context);
    v1::QueryUploadRequest other_question;
    other_question.set_sha256(header.sha256());
    v1::QueryUploadResponse answer;
    EXPECT_TRUE(alice.stub().QueryUpload(&other_context, other_question, &answer).ok());
  };

  ask();
  EXPECT_EQ(alice.Render(frame).status.error_code(), StatusCode::NOT_FOUND);
  // Breaks off when half has arrived, goes on, is there; another is not what it promises to be.
  const auto half_arrived = [&] { return Becomes("halflight_upload_memory_bytes", 8000.0); };
  EXPECT_FALSE(alice.Upload({Header(header), Chunk(half)}, half_arrived).status.ok());
  ASSERT_TRUE(Becomes("halflight_partial_uploads", 1.0));
  EXPECT_TRUE(
      alice.Upload({Header(header, 8000), Chunk(set.payload().substr(8000)), Finish(header)})
          .status.ok());
  EXPECT_TRUE(alice.Upload({Header(header)}).status.ok());
  v1::ParticleSetDescription other = header;
  other.set_sha256(std::string(32, 'x'));
  EXPECT_EQ(alice.Upload({Header(other), Chunk(set.payload()), Finish(other)}).status.error_code(),
            StatusCode::DATA_LOSS);
  ask();
  EXPECT_TRUE(alice.Render(frame).status.ok());

  ASSERT_TRUE(testing::WaitFor([&] { return Page().Sum("halflight_calls_in_progress") == 0.0; }));
  ASSERT_TRUE(Becomes("halflight_disk_cache_sets", 1.0));
  const MetricsPage page = Page();
  EXPECT_EQ(page[R"(halflight_uploads_begun_total{resumed="false"})"], 3.0);
  EXPECT_EQ(page[R"(halflight_uploads_begun_total{resumed="true"})"], 1.0);
  for (const char* end : {"committed", "already_present", "broken_off", "refused"}) {
    EXPECT_EQ(page["halflight_uploads_ended_total{end=\"" + std::string(end) + "\"}"], 1.0) << end;
  }
  EXPECT_EQ(page[R"(halflight_particle_sets_asked_total{answer="missing"})"], 4.0);
  EXPECT_EQ(page[R"(halflight_particle_sets_asked_total{answer="present"})"], 2.0);
  EXPECT_EQ(page[R"(halflight_cache_lookups_total{result="hit"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_cache_lookups_total{result="miss"})"], 1.0);
  EXPECT_EQ(page["halflight_cache_sets"], 1.0);
  EXPECT_EQ(page["halflight_cache_bytes"], 16000.0);
  EXPECT_EQ(page["halflight_disk_cache_bytes"], 4 * 4096.0);
  EXPECT_EQ(page[R"(halflight_disk_cache_reads_total{result="ok"})"], 0.0);
  EXPECT_EQ(page["halflight_upload_memory_bytes"], 0.0);
  EXPECT_EQ(page["halflight_partial_uploads"], 0.0);
  EXPECT_EQ(page[R"(halflight_errors_total{code="DATA_LOSS",reason="CHECKSUM_MISMATCH"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_errors_total{code="NOT_FOUND",reason="PARTICLES_NOT_FOUND"})"], 1.0);
}

TEST_F(Scraped, SetsComeFromDiskAfterARestart) {
  const v1::InlineParticles set = testing::MakeParticles(
      1000, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS});
  const v1::ParticleSetDescription header = Describe(set);
  Start({"--cache-dir", folder_ / "cache"});
  EXPECT_TRUE(Alice().Upload({Header(header), Chunk(set.payload()), Finish(header)}).status.ok());
  server_->Signal(SIGTERM);
  ASSERT_EQ(server_->Wait(), 0);
  Start({"--cache-dir", folder_ / "cache"});
  v1::RenderFrameRequest frame = MakeRequest();
  frame.mutable_scene()->set_particle_sha256(header.sha256());
  EXPECT_TRUE(Alice().Render(frame).status.ok());
  const MetricsPage page = Page();
  EXPECT_EQ(page[R"(halflight_disk_cache_reads_total{result="ok"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_disk_cache_reads_total{result="failed"})"], 0.0);
  EXPECT_EQ(page[R"(halflight_cache_lookups_total{result="hit"})"], 1.0);
}

TEST_F(Scraped, StalledCallsAndRefusedConnectionsAreCounted) {
  Start({"--max-stall-seconds", "1", "--max-connections", "1"});
  TestCaller alice = Alice();
  grpc::ClientContext context;
  alice.Prepare(context);
  v1::UploadParticlesResponse response;
  const auto writer = alice.stub().UploadParticles(&context, &response);
  ASSERT_TRUE(Becomes("halflight_connections", 1.0));
  EXPECT_EQ(testing::Get(address_, "/"), "");
  EXPECT_TRUE(Becomes("halflight_connections_refused_total", 1.0));
  EXPECT_TRUE(Becomes(R"(halflight_cancellations_total{by="stall"})", 1.0));
  EXPECT_EQ(Page()["halflight_connections_accepted_total"], 1.0);
  EXPECT_EQ(writer->Finish().error_code(), StatusCode::CANCELLED);
}

}  // namespace
}  // namespace halflight
