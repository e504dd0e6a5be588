// What client.cpp and sequence*.cpp share: the channel, and how a call is tried.
// Not for users of the library.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <string>
#include <string_view>

#include "client/client.h"
#include "client/retry.h"
#include "halflight/v1/service.grpc.pb.h"

namespace halflight::client {

using Clock = std::chrono::system_clock;  // what gRPC takes deadlines in

// How the call ended, with the time to wait that gRPC's convention for retries has in its trailing
// metadata. CANCELLED becomes UNAVAILABLE: where the caller did not ask for it, the server or a
// proxy has ended the call, such as one that stalled.
absl::Status FromGrpc(const grpc::Status& status, const grpc::ClientContext& context);

class Client::Impl {
 public:
  Impl(const std::string& address, const std::shared_ptr<grpc::ChannelCredentials>& credentials,
       ClientOptions options);

  bool WaitForConnection(std::chrono::milliseconds time, const std::stop_token& stop);

  // Each does what the method of Client does, ending early when `stop` is requested. `route` is the
  // particle set by which a proxy may choose a server, so that a frame goes where its particles
  // went; empty: none.
  absl::StatusOr<v1::GetServerInfoResponse> GetServerInfo(const std::stop_token& stop);
  absl::StatusOr<std::vector<std::string>> FindMissing(const std::vector<std::string>& sha256,
                                                       std::string_view route,
                                                       const std::stop_token& stop);
  absl::Status EnsureUploaded(const EncodedParticles& particles, std::string_view route,
                              const std::stop_token& stop);
  absl::StatusOr<RenderedFrame> RenderFrame(const v1::RenderFrameRequest& request);
  absl::Status RenderSequence(uint64_t count, const FrameSource& source, const FrameSink& sink,
                              uint32_t read_ahead);

  [[nodiscard]] UploadTotals upload_totals() const { return {sent_bytes_, saved_bytes_}; }
  [[nodiscard]] const ClientOptions& options() const { return options_; }

 private:
  // Calls `attempt` with a fresh context until it succeeds, fails for good, or time or tries are
  // used up.
  absl::Status Try(std::string_view route, const std::stop_token& stop,
                   const std::function<absl::Status(grpc::ClientContext&)>& attempt);
  // Waits between tries; false when `stop` was requested. A connection that is lost comes up again
  // only while somebody waits on its channel: calls on it fail at once, and nothing else drives it.
  bool Pause(std::chrono::milliseconds time, const std::stop_token& stop);
  // As a part of the try that `context` is of: what the server has of a set.
  absl::StatusOr<v1::QueryUploadResponse> QueryUpload(const grpc::ClientContext& context,
                                                      const std::string& sha256,
                                                      std::string_view route,
                                                      const std::stop_token& stop);
  absl::Status UploadFrom(uint64_t offset, grpc::ClientContext& context,
                          const EncodedParticles& particles);
  absl::StatusOr<RenderedFrame> RenderOnce(grpc::ClientContext& context,
                                           const v1::RenderFrameRequest& request);

  std::string address_;
  ClientOptions options_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::RenderService::Stub> stub_;
  std::atomic<uint64_t> sent_bytes_ = 0;
  std::atomic<uint64_t> saved_bytes_ = 0;
};

// Adds the metadata that names the particle set, and the one that says who calls; nothing for an
// empty route or token.
void SetMetadata(grpc::ClientContext& context, std::string_view route, const std::string& token);

}  // namespace halflight::client
