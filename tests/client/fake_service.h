// A render service in this process that renders nothing: it keeps particle sets, answers with
// outputs of known bytes, and fails where a test tells it to.
#pragma once

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "halflight/crc32c.h"
#include "halflight/particle_payload.h"
#include "halflight/v1/service.grpc.pb.h"

namespace halflight::client {

class FakeService final : public v1::RenderService::Service {
 public:
  // Port 0 takes a free one.
  explicit FakeService(const std::string& address = "127.0.0.1:0") {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
    address_ = port > 1 ? "127.0.0.1:" + std::to_string(port) : address;
  }
  ~FakeService() override { server_->Shutdown(std::chrono::system_clock::now()); }
  FakeService(const FakeService&) = delete;
  FakeService& operator=(const FakeService&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }

  // The next calls of an RPC end with these; an OK among them lets one call pass.
  void FailNext(const std::string& rpc, std::vector<grpc::Status> statuses) {
    const std::lock_guard lock(mutex_);
    failures_[rpc].insert(failures_[rpc].end(), statuses.begin(), statuses.end());
  }
  int Calls(const std::string& rpc) {
    const std::lock_guard lock(mutex_);
    return calls_[rpc];
  }
  // The server has these bytes of an upload that broke off.
  void KeepPartial(const std::string& sha256, const std::string& payload) {
    const std::lock_guard lock(mutex_);
    partial_[sha256] = payload;
  }
  void Evict(const std::string& sha256) {
    const std::lock_guard lock(mutex_);
    sets_.erase(sha256);
  }
  // May change a message of a frame before it is sent.
  std::function<void(v1::RenderSequenceResponse& message)> tamper;
  // Called with each request of a sequence as it came.
  std::function<void(const v1::RenderFrameRequest& request)> on_request;
  // Called with the index of each request of a sequence before it is answered.
  std::function<grpc::Status(uint64_t index)> before_frame;
  // Whether a RESOURCE_EXHAUSTED of FailNext says when to come again.
  bool gives_hints = true;
  // Before this request of a sequence is read, a frame without outputs is sent all the same.
  std::optional<uint64_t> unasked_frame;
  // Of sequences whose frames were all sent.
  grpc::Status end_of_sequence;
  int evict_after_upload = 0;       // so many sets are dropped as soon as they are complete
  std::vector<std::string> routes;  // metadata of renders, in hexadecimal

  // The bytes of an output: they tell the set and the request apart.
  static std::string OutputBytes(const v1::RenderFrameRequest& request, int output) {
    std::string bytes = request.scene().particle_sha256() + request.request_id();
    bytes += static_cast<char>('0' + output);
    bytes.append(400000, static_cast<char>(output));  // two chunks
    return bytes;
  }

  grpc::Status GetServerInfo(grpc::ServerContext* context,
                             const v1::GetServerInfoRequest* /*request*/,
                             v1::GetServerInfoResponse* response) override {
    response->set_server_version("fake");
    return Enter("GetServerInfo", *context);
  }

  grpc::Status FindMissingParticles(grpc::ServerContext* context,
                                    const v1::FindMissingParticlesRequest* request,
                                    v1::FindMissingParticlesResponse* response) override {
    if (grpc::Status status = Enter("FindMissingParticles", *context); !status.ok()) {
      return status;
    }
    const std::lock_guard lock(mutex_);
    for (const std::string& sha256 : request->sha256()) {
      if (sets_.count(sha256) == 0) {
        response->add_missing_sha256(sha256);
      }
    }
    return grpc::Status::OK;
  }

  grpc::Status QueryUpload(grpc::ServerContext* context, const v1::QueryUploadRequest* request,
                           v1::QueryUploadResponse* response) override {
    if (grpc::Status status = Enter("QueryUpload", *context); !status.ok()) {
      return status;
    }
    const std::lock_guard lock(mutex_);
    response->set_complete(sets_.count(request->sha256()) != 0);
    response->set_committed_bytes(partial_[request->sha256()].size());
    return grpc::Status::OK;
  }

  grpc::Status UploadParticles(grpc::ServerContext* context,
                               grpc::ServerReader<v1::UploadParticlesRequest>* reader,
                               v1::UploadParticlesResponse* /*response*/) override {
    if (grpc::Status status = Enter("UploadParticles", *context); !status.ok()) {
      return status;
    }
    v1::UploadParticlesRequest message;
    v1::ParticleSetDescription header;
    std::string payload;
    bool finished = false;
    while (!finished && reader->Read(&message)) {
      const std::lock_guard lock(mutex_);
      if (message.has_header()) {
        header = message.header();
        resume_offsets.push_back(header.resume_offset());
        std::string kept = std::move(partial_[header.sha256()]);
        partial_.erase(header.sha256());
        if (header.resume_offset() > kept.size()) {
          return {grpc::StatusCode::OUT_OF_RANGE, "header.resume_offset"};
        }
        payload = kept.substr(0, header.resume_offset());
      } else if (message.has_finish()) {
        finished = message.finish().sha256() == header.sha256() &&
                   message.finish().byte_size() == payload.size();
      } else {
        largest_chunk = std::max(largest_chunk, message.chunk().size());
        payload += message.chunk();
        if (!break_uploads_at.empty() && payload.size() >= break_uploads_at.front()) {
          break_uploads_at.pop_front();
          partial_[header.sha256()] = payload;
          return {grpc::StatusCode::UNAVAILABLE, "broken off"};
        }
      }
    }
    Sha256 sha = BeginParticleDigest(header.layout());
    sha.Update(payload);
    if (!finished || sha.Finish() != header.sha256()) {
      return {grpc::StatusCode::DATA_LOSS, "digest"};
    }
    const std::lock_guard lock(mutex_);
    if (evict_after_upload > 0) {
      --evict_after_upload;
    } else {
      sets_.insert(header.sha256());
    }
    return grpc::Status::OK;
  }
  size_t largest_chunk = 0;
  std::vector<uint64_t> resume_offsets;   // of the uploads, in order
  std::deque<uint64_t> break_uploads_at;  // bytes of payload at which the next ones break off

  grpc::Status RenderFrame(grpc::ServerContext* context, const v1::RenderFrameRequest* request,
                           grpc::ServerWriter<v1::RenderFrameResponse>* writer) override {
    if (grpc::Status status = Enter("RenderFrame", *context); !status.ok()) {
      return status;
    }
    NoteRoute(*context);
    return Answer(0, *request, [writer](const v1::RenderSequenceResponse& message) {
      v1::RenderFrameResponse response;
      if (message.has_header()) {
        *response.mutable_header() = message.header();
      } else if (message.has_chunk()) {
        *response.mutable_chunk() = message.chunk();
      } else if (message.has_trailer()) {
        *response.mutable_trailer() = message.trailer();
      }
      writer->Write(response);
    });
  }

  grpc::Status RenderSequence(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<v1::RenderSequenceResponse, v1::RenderSequenceRequest>* stream)
      override {
    if (grpc::Status status = Enter("RenderSequence", *context); !status.ok()) {
      return status;
    }
    NoteRoute(*context);
    v1::RenderSequenceRequest request;
    v1::RenderFrameRequest before;
    for (uint64_t index = 0;; ++index) {
      if (index == unasked_frame) {
        SendEmptyFrame(index, *stream);
      }
      if (!stream->Read(&request)) {
        return end_of_sequence;
      }
      v1::RenderFrameRequest& frame = *request.mutable_frame();
      if (on_request) {
        on_request(frame);
      }
      if (frame.outputs().empty()) {
        *frame.mutable_outputs() = before.outputs();
      }
      if (frame.scene().particle_sha256().empty()) {
        frame.mutable_scene()->set_particle_sha256(before.scene().particle_sha256());
      }
      before = frame;
      grpc::Status status = before_frame ? before_frame(index) : grpc::Status::OK;
      if (status.ok()) {
        status = Answer(index, frame, [stream](const v1::RenderSequenceResponse& message) {
          stream->Write(message);
        });
      }
      if (!status.ok()) {
        return {status.error_code(),
                "frame " + std::to_string(index) + ": " + status.error_message()};
      }
    }
  }

 private:
  grpc::Status Enter(const std::string& rpc, grpc::ServerContext& context) {
    const std::lock_guard lock(mutex_);
    ++calls_[rpc];
    std::deque<grpc::Status>& failures = failures_[rpc];
    if (failures.empty()) {
      return grpc::Status::OK;
    }
    grpc::Status status = failures.front();
    failures.pop_front();
    if (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED && gives_hints) {
      context.AddTrailingMetadata("grpc-retry-pushback-ms", "1");
    }
    return status;
  }

  static void SendEmptyFrame(
      uint64_t index,
      grpc::ServerReaderWriter<v1::RenderSequenceResponse, v1::RenderSequenceRequest>& stream) {
    v1::RenderSequenceResponse message;
    message.set_frame_index(index);
    message.mutable_header();
    stream.Write(message);
    message.mutable_trailer();
    stream.Write(message);
  }

  void NoteRoute(const grpc::ServerContext& context) {
    const std::lock_guard lock(mutex_);
    const auto found = context.client_metadata().find("halflight-particle-sha256");
    routes.emplace_back(found == context.client_metadata().end()
                            ? ""
                            : std::string(found->second.data(), found->second.size()));
  }

  template <typename Write>
  grpc::Status Answer(uint64_t index, const v1::RenderFrameRequest& request, Write write) {
    {
      const std::lock_guard lock(mutex_);
      if (sets_.count(request.scene().particle_sha256()) == 0) {
        return {grpc::StatusCode::NOT_FOUND, "scene.particle_sha256 is not here"};
      }
    }
    auto send = [&](v1::RenderSequenceResponse message) {
      message.set_frame_index(index);
      if (tamper) {
        tamper(message);
      }
      write(message);
    };
    v1::RenderSequenceResponse header;
    v1::RenderSequenceResponse trailer;
    header.mutable_header()->mutable_metadata()->set_request_id(request.request_id());
    for (int i = 0; i < request.outputs_size(); ++i) {
      const std::string bytes = OutputBytes(request, i);
      v1::OutputInfo& info = *header.mutable_header()->add_outputs();
      *info.mutable_output() = request.outputs(i);
      info.set_byte_size(bytes.size());
      trailer.mutable_trailer()->add_output_crc32c(ExtendCrc32c(0, bytes));
    }
    send(header);
    for (int i = 0; i < request.outputs_size(); ++i) {
      const std::string bytes = OutputBytes(request, i);
      for (size_t at = 0; at < bytes.size(); at += 262144) {
        v1::RenderSequenceResponse chunk;
        chunk.mutable_chunk()->set_output_index(static_cast<uint32_t>(i));
        chunk.mutable_chunk()->set_offset(at);
        chunk.mutable_chunk()->set_data(bytes.substr(at, 262144));
        send(chunk);
      }
    }
    send(trailer);
    return grpc::Status::OK;
  }

  std::mutex mutex_;
  std::map<std::string, std::deque<grpc::Status>> failures_;
  std::map<std::string, int> calls_;
  std::set<std::string> sets_;
  std::map<std::string, std::string> partial_;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace halflight::client
