// What is counted, and what is read off the parts when somebody looks.

#include "server/metrics/metrics_page.h"

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <prometheus/text_serializer.h>

#include "halflight/v1/service.grpc.pb.h"
#include "server/error_detail.h"
#include "server/metrics/prometheus_metrics.h"
#include "tests/metrics/page.h"
#include "tests/process/wait_for.h"
#include "tests/sanitizers.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using testing::MetricsPage;

MetricsPage PageOf(const PrometheusMetrics& metrics) {
  return MetricsPage(prometheus::TextSerializer().Serialize(metrics.Collect()));
}

TEST(PrometheusMetrics, FramesAreToldApartAndTimedByStage) {
  PrometheusMetrics metrics;
  for (int i = 0; i < 2; ++i) {
    metrics.OnFrame("alice", ShadowTechniqueKind::kLightSweep, absl::StatusCode::kOk,
                    {{"light camera", 3.0}, {"total", 250.0}});
  }
  metrics.OnFrame("bob", ShadowTechniqueKind::kHalfAngle, absl::StatusCode::kCancelled,
                  {{"total", 1000.0}});
  metrics.OnFrameRefused("bob", absl::StatusCode::kInvalidArgument);
  metrics.OnFrameSent(std::chrono::milliseconds(20));
  const MetricsPage page = PageOf(metrics);
  EXPECT_EQ(page[R"(halflight_frames_total{outcome="OK",technique="light_sweep",tenant="alice"})"],
            2.0);
  EXPECT_EQ(
      page[R"(halflight_frames_total{outcome="CANCELLED",technique="half_angle",tenant="bob"})"],
      1.0);
  EXPECT_EQ(
      page[R"(halflight_frames_total{outcome="INVALID_ARGUMENT",technique="none",tenant="bob"})"],
      1.0);
  EXPECT_EQ(page.Sum("halflight_frames_total"), 4.0);
  // In seconds; what did not come to a frame says nothing of how long frames take.
  EXPECT_EQ(page[R"(halflight_frame_stage_seconds_count{stage="total"})"], 2.0);
  EXPECT_DOUBLE_EQ(page[R"(halflight_frame_stage_seconds_sum{stage="total"})"], 0.5);
  EXPECT_EQ(page[R"(halflight_frame_stage_seconds_bucket{stage="total",le="0.1"})"], 0.0);
  EXPECT_EQ(page[R"(halflight_frame_stage_seconds_bucket{stage="total",le="0.25"})"], 2.0);
  EXPECT_EQ(page[R"(halflight_frame_stage_seconds_count{stage="light_camera"})"], 2.0);
  EXPECT_EQ(page[R"(halflight_frame_stage_seconds_count{stage="send"})"], 1.0);
  EXPECT_DOUBLE_EQ(page[R"(halflight_frame_stage_seconds_sum{stage="send"})"], 0.02);
}

TEST(PrometheusMetrics, TenantsBeyondTheBoundAreOneSeries) {
  PrometheusMetrics metrics;
  for (size_t i = 0; i < PrometheusMetrics::kMaxTenants + 50; ++i) {
    metrics.OnFrameRefused("tenant" + std::to_string(i), absl::StatusCode::kOk);
  }
  metrics.OnFrameRefused("tenant0", absl::StatusCode::kOk);
  const MetricsPage page = PageOf(metrics);
  EXPECT_EQ(page[R"(halflight_frames_total{outcome="OK",technique="none",tenant="other"})"], 50.0);
  EXPECT_EQ(page[R"(halflight_frames_total{outcome="OK",technique="none",tenant="tenant0"})"], 2.0);
}

TEST(PrometheusMetrics, ErrorsAreCountedByReason) {
  PrometheusMetrics metrics;
  metrics.OnCall(Rpc::kRenderFrame, absl::OkStatus(), Cancellation::kNone);
  metrics.OnCall(Rpc::kRenderFrame, BusyError(v1::ERROR_REASON_QUEUE_FULL, "9", "8"),
                 Cancellation::kNone);
  metrics.OnCall(Rpc::kUploadParticles, absl::CancelledError("gone"), Cancellation::kStall);
  const MetricsPage page = PageOf(metrics);
  EXPECT_EQ(page[R"(halflight_calls_total{code="OK",rpc="RenderFrame"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_calls_total{code="RESOURCE_EXHAUSTED",rpc="RenderFrame"})"], 1.0);
  EXPECT_EQ(page.Sum("halflight_errors_total"), 2.0);
  EXPECT_EQ(page[R"(halflight_errors_total{code="RESOURCE_EXHAUSTED",reason="QUEUE_FULL"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_errors_total{code="CANCELLED",reason="UNSPECIFIED"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_cancellations_total{by="stall"})"], 1.0);
  EXPECT_EQ(page.Sum("halflight_cancellations_total"), 1.0);
}

TEST(PrometheusMetrics, WhatHasNotHappenedYetIsZeroNotMissing) {
  const MetricsPage page = PageOf(PrometheusMetrics());
  for (const char* series : {R"(halflight_calls_total{code="OK",rpc="QueryUpload"})",
                             R"(halflight_uploads_ended_total{end="broken_off"})",
                             R"(halflight_uploads_begun_total{resumed="true"})",
                             R"(halflight_cancellations_total{by="client"})",
                             R"(halflight_sent_bytes_total{rpc="RenderSequence"})"}) {
    EXPECT_TRUE(page.Has(series)) << series;
  }
}

class OverdueEngine : public testing::FakeEngine {
 public:
  [[nodiscard]] EngineState state() const override {
    return {.gl_objects = 7,
            .gl_bytes = uint64_t{5} << 32U,
            .device_resets = 3,
            .end = {},
            .overdue_since = std::chrono::steady_clock::now() - std::chrono::minutes(2)};
  }
};

TEST(ServerState, IsReadWhenSomebodyLooks) {
  OverdueEngine engine;
  const ServerLimits limits{.max_queued_frames = 11};
  const std::string version = "1.2.3";
  ParticleStore store(8 << 20);
  ByteBudget upload_memory(8 << 20);
  PartialUploads partial_uploads(upload_memory, {});
  FramePipeline pipeline(engine, {.encode = testing::EncodePlain});
  PrometheusMetrics counted;
  const Backend backend{engine.device(), limits,   version, store,
                        partial_uploads, pipeline, counted};
  auto server = GrpcServer::Start({"127.0.0.1:0"}, backend);
  ASSERT_TRUE(server.ok()) << server.status();
  auto sockets = ListeningSocket::Bind("127.0.0.1:0");
  ASSERT_TRUE(sockets.ok());
  const std::string address = sockets->front().address();
  const auto shown = ShowMetrics(*std::move(sockets), counted, {engine, backend, **server});
  ASSERT_TRUE(shown.ok());

  MetricsPage page = MetricsPage::Fetch(address);
  EXPECT_EQ(page["halflight_gl_objects"], 7.0);
  EXPECT_EQ(page["halflight_gl_memory_bytes"], 5.0 * 0x1p32);
  EXPECT_EQ(page["halflight_device_resets_total"], 3.0);
  EXPECT_GE(page["halflight_device_overdue_seconds"], 120.0);
  EXPECT_EQ(page[R"(halflight_limit{name="max_queued_frames"})"], 11.0);
  EXPECT_EQ(
      page[R"(halflight_build_info{version="1.2.3",gl_renderer="fake",gl_version="4.5 fake"})"],
      1.0);
  EXPECT_EQ(page["halflight_serving"], 1.0);
  EXPECT_EQ(page["halflight_connections"], 0.0);
  EXPECT_GT(page["process_resident_memory_bytes"], 1e6);
  EXPECT_GT(page["process_heap_bytes"], testing::kSanitized ? -1.0 : 1e5) << "of glibc's allocator";
  EXPECT_GT(page["process_threads"], 2.0);
  EXPECT_GT(page["process_open_fds"], 3.0);
  EXPECT_GT(page["process_start_time_seconds"], 1.6e9);

  ParticleSet set;
  set.positions.resize(2);
  EXPECT_TRUE(store.Insert("a", std::make_shared<const ParticleSet>(std::move(set))).ok());
  engine.SetGate(false);
  const auto stub = v1::RenderService::NewStub(
      grpc::CreateChannel((*server)->addresses()[0], grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto reader = stub->RenderFrame(&context, testing::MakeRequest());
  ASSERT_TRUE(testing::WaitFor([&] { return engine.waiting() == 1; }));
  page = MetricsPage::Fetch(address);
  EXPECT_EQ(page["halflight_cache_sets"], 1.0);
  EXPECT_EQ(page["halflight_cache_bytes"], 24.0);
  EXPECT_EQ(page["halflight_frames_in_progress"], 1.0);
  EXPECT_EQ(page["halflight_frames_queued"], 0.0);
  EXPECT_EQ(page["halflight_frame_memory_bytes"], 64.0 * 48 * 16);
  EXPECT_EQ(page[R"(halflight_calls_in_progress{rpc="RenderFrame"})"], 1.0);
  EXPECT_EQ(page[R"(halflight_calls_in_progress{rpc="UploadParticles"})"], 0.0);
  EXPECT_EQ(page["halflight_connections"], 1.0);
  EXPECT_EQ(page["halflight_connections_accepted_total"], 1.0);
  context.TryCancel();
  EXPECT_FALSE(reader->Finish().ok());
  (*server)->BeginDrain();
  EXPECT_EQ(MetricsPage::Fetch(address)["halflight_serving"], 0.0);
}

}  // namespace
}  // namespace halflight
