// The whole service in this process, on a free port and on a unix socket, with the real renderer.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "client/client.h"
#include "halflight/v1/service.grpc.pb.h"
#include "renderer/render_thread.h"
#include "server/grpc_server.h"

namespace halflight::loopback {

// One renderer for all tests of a process: what its frames are must not depend on those before.
FrameEngine& Engine();

class TestServer {
 public:
  explicit TestServer(const ServerLimits& limits = {});

  [[nodiscard]] const std::string& tcp_address() const { return server_->addresses()[0]; }
  [[nodiscard]] const std::string& unix_address() const { return server_->addresses()[1]; }
  [[nodiscard]] bool idle() const { return server_->idle(); }

  [[nodiscard]] client::Client Connect(const client::ClientOptions& options = {}) const;
  [[nodiscard]] std::unique_ptr<v1::RenderService::Stub> Stub() const;

 private:
  ServerLimits limits_;
  std::string version_ = "test";
  ParticleStore store_;
  ByteBudget upload_memory_;
  PartialUploads partial_uploads_;
  FramePipeline pipeline_;
  std::unique_ptr<GrpcServer> server_;
};

// Keeps the renderer's thread busy while it lives, so that frames wait for certain.
class RendererHeld {
 public:
  RendererHeld();
  ~RendererHeld();
  RendererHeld(const RendererHeld&) = delete;
  RendererHeld& operator=(const RendererHeld&) = delete;

 private:
  std::promise<void> release_;
};

// The frame; fails the test, and is empty, where there is none.
client::RenderedFrame MustRender(client::Client& client, const v1::RenderFrameRequest& request,
                                 const client::EncodedParticles* particles = nullptr);

// The whole answer to a bare call, without the client library.
grpc::Status Ask(v1::RenderService::Stub& stub, const v1::RenderFrameRequest& request);

}  // namespace halflight::loopback
