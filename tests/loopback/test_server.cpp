#include "tests/loopback/test_server.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <utility>

#include <grpcpp/grpcpp.h>

#include "tests/renderer/test_scene.h"

namespace halflight::loopback {

FrameEngine& Engine() {
  static const std::unique_ptr<FrameEngine> engine = [] {
    auto started = StartRenderThread({});
    if (!started.ok()) {
      ADD_FAILURE() << started.status();
      std::abort();
    }
    return *std::move(started);
  }();
  return *engine;
}

TestServer::TestServer(const ServerLimits& limits)
    : limits_(LimitsOnDevice(limits, Engine().device())),
      store_(limits.max_cache_bytes),
      upload_memory_(limits.max_cache_bytes),
      partial_uploads_(upload_memory_, {.max_count = limits.max_partial_uploads}),
      pipeline_(Engine(), {.admission = {.max_queued_frames = limits.max_queued_frames},
                           .encode_threads = 2}) {
  static std::atomic<int> sockets = 0;
  const std::string socket = "unix:" + ::testing::TempDir() + "halflight-loopback." +
                             std::to_string(getpid()) + "." + std::to_string(sockets++);
  auto server = GrpcServer::Start({"127.0.0.1:0", socket}, {Engine().device(), limits_, version_,
                                                            store_, partial_uploads_, pipeline_});
  if (!server.ok()) {
    ADD_FAILURE() << server.status();
    std::abort();
  }
  server_ = *std::move(server);
}

client::Client TestServer::Connect(const client::ClientOptions& options) const {
  auto client = client::Client::Connect(tcp_address(), options);
  EXPECT_TRUE(client.ok()) << client.status();
  return *std::move(client);
}

std::unique_ptr<v1::RenderService::Stub> TestServer::Stub() const {
  return v1::RenderService::NewStub(
      grpc::CreateChannel(tcp_address(), grpc::InsecureChannelCredentials()));
}

RendererHeld::RendererHeld() {
  std::promise<void> held;
  std::future<void> is_held = held.get_future();
  const absl::Status status = Engine().Submit(
      test::Beauty(test::BallScene(1, 8)), {},
      [released = release_.get_future().share(), &held](const absl::StatusOr<FrameResult>&) {
        held.set_value();
        released.wait();
      });
  EXPECT_TRUE(status.ok()) << status;
  if (status.ok()) {
    is_held.wait();
  }
}

RendererHeld::~RendererHeld() { release_.set_value(); }

client::RenderedFrame MustRender(client::Client& client, const v1::RenderFrameRequest& request,
                                 const client::EncodedParticles* particles) {
  auto frame = client.RenderFrame(request, particles);
  EXPECT_TRUE(frame.ok()) << frame.status();
  if (!frame.ok()) {
    client::RenderedFrame none;
    none.outputs.resize(static_cast<size_t>(request.outputs_size()));
    return none;
  }
  return *std::move(frame);
}

grpc::Status Ask(v1::RenderService::Stub& stub, const v1::RenderFrameRequest& request) {
  grpc::ClientContext context;
  const auto reader = stub.RenderFrame(&context, request);
  v1::RenderFrameResponse response;
  while (reader->Read(&response)) {
  }
  return reader->Finish();
}

}  // namespace halflight::loopback
