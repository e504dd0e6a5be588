// Frames that come too late or too many at once: told so, and nothing of them stays behind.

#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/process/wait_for.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

using absl::StatusCode;
using testing::WaitFor;

// Minutes of work on any CPU, in thousands of short passes: who waits for its end waits in vain.
v1::RenderFrameRequest LongRequest() {
  Scene scene = test::BallScene(30000, 512);
  scene.material.radius = 0.3F;
  scene.shadow.slices = 60000;
  scene.shadow.light_buffer_size = 4096;
  scene.sampling.supersample = 4;
  return RequestOf(scene);
}

TEST(Limits, DeadlineBeforeTheFrameIsDoneEndsIt) {
  const TestServer server;
  client::ClientOptions options;
  options.timeout = std::chrono::milliseconds(200);
  client::Client hasty = server.Connect(options);
  const auto late = hasty.RenderFrame(LongRequest());
  EXPECT_EQ(late.status().code(), StatusCode::kDeadlineExceeded) << late.status();

  client::Client patient = server.Connect();
  MustRender(patient, RequestOf(test::BallScene(50, 32)));
  EXPECT_TRUE(WaitFor([&] { return server.idle(); }));
}

TEST(Limits, CancelledWhileItRendersTheServerRendersOn) {
  const TestServer server;
  const auto stub = server.Stub();
  const v1::RenderFrameRequest request = LongRequest();
  grpc::ClientContext context;
  grpc::Status status;
  std::jthread caller([&] {
    const auto reader = stub->RenderFrame(&context, request);
    v1::RenderFrameResponse response;
    while (reader->Read(&response)) {
    }
    status = reader->Finish();
  });
  ASSERT_TRUE(WaitFor([&] { return !server.idle(); }));
  context.TryCancel();
  caller.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
  client::Client client = server.Connect();
  MustRender(client, RequestOf(test::BallScene(50, 32)));
}

TEST(Limits, FullQueueRefusesOneFrameAndKeepsTheOthers) {
  ServerLimits limits;
  limits.max_queued_frames = 2;
  const TestServer server(limits);
  client::ClientOptions once;
  once.max_attempts = 1;
  client::Client client = server.Connect(once);
  const v1::RenderFrameRequest request = RequestOf(test::BallScene(50, 16));
  std::atomic<int> done = 0;
  std::atomic<int> refused = 0;
  {
    std::vector<std::jthread> callers;
    callers.reserve(3);
    const RendererHeld held;
    for (int i = 0; i < 3; ++i) {
      callers.emplace_back([&] {
        const auto frame = client.RenderFrame(request);
        if (frame.ok()) {
          ++done;
        } else {
          EXPECT_EQ(frame.status().code(), StatusCode::kResourceExhausted) << frame.status();
          ++refused;
        }
      });
    }
    EXPECT_TRUE(WaitFor([&] { return refused == 1; }));
  }
  EXPECT_EQ(done, 2);
  EXPECT_EQ(refused, 1);
}

TEST(Limits, ClientThatTriesAgainGetsItsFrameOutOfAFullQueue) {
  ServerLimits limits;
  limits.max_queued_frames = 1;
  const TestServer server(limits);
  client::ClientOptions options;
  options.max_attempts = 1000;
  client::Client client = server.Connect(options);
  const v1::RenderFrameRequest request = RequestOf(test::BallScene(50, 16));
  std::atomic<int> done = 0;
  {
    std::vector<std::jthread> callers;
    callers.reserve(4);
    const RendererHeld held;
    for (int i = 0; i < 4; ++i) {
      callers.emplace_back([&] { done += client.RenderFrame(request).ok() ? 1 : 0; });
    }
    // One of them is in the queue for certain: the server refuses another one.
    const auto stub = server.Stub();
    EXPECT_TRUE(WaitFor([&] {
      grpc::ClientContext context;
      context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
      const auto reader = stub->RenderFrame(&context, request);
      v1::RenderFrameResponse response;
      reader->Read(&response);
      return reader->Finish().error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED;
    }));
  }
  EXPECT_EQ(done, 4);
}

TEST(Limits, AreThoseThatTheServerTells) {
  ServerLimits limits;
  limits.max_image_size = 64;
  limits.max_slices = 10;
  const TestServer server(limits);
  client::Client client = server.Connect();
  const auto info = client.GetServerInfo();
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->limits().max_image_size(), 64U);
  EXPECT_EQ(info->gl_renderer(), Engine().device().gl_renderer);
  EXPECT_EQ(info->output_kinds_size(), 7);
  EXPECT_EQ(info->formats_size(), 5);
  Scene scene = test::BallScene(50, 64);
  scene.shadow.slices = 10;
  MustRender(client, RequestOf(scene));
  scene.camera.width = scene.camera.window.width = 65;
  EXPECT_EQ(client.RenderFrame(RequestOf(scene)).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace halflight::loopback
