#include "server/render_service.h"

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "halflight/v1/service.grpc.pb.h"
#include "renderer/field_error.h"
#include "server/call_token.h"
#include "server/handlers/find_missing_particles.h"
#include "server/handlers/get_server_info.h"
#include "server/handlers/query_upload.h"
#include "server/handlers/render_frame.h"
#include "server/handlers/render_sequence.h"
#include "server/handlers/upload_particles.h"
#include "server/message_buffer.h"
#include "server/stall_guard.h"

// The callback API deletes a reactor in OnDone, which comes after Finish and after every reaction
// has returned. So a reactor never touches itself after Finish other than by returning, and
// whatever may outlast the call (a handler that the pipeline still holds) is shared and leaves its
// sink alone once it has finished it.

namespace halflight {
namespace {

using grpc::CallbackServerContext;

// Sequences under way: a drain ends each where it stands, since its client may never say that it
// wants no more.
class OpenSequences {
 public:
  // Until `handler` is gone.
  void Add(const std::shared_ptr<RenderSequenceHandler>& handler) {
    const std::lock_guard lock(mutex_);
    std::erase_if(open_, [](const auto& other) { return other.expired(); });
    open_.push_back(handler);
    if (draining_) {
      handler->OnDrain();
    }
  }

  void Drain() {
    std::vector<std::weak_ptr<RenderSequenceHandler>> open;
    {
      const std::lock_guard lock(mutex_);
      draining_ = true;
      open.swap(open_);
    }
    for (const auto& handler : open) {
      if (const auto locked = handler.lock()) {
        locked->OnDrain();
      }
    }
  }

 private:
  std::mutex mutex_;
  std::vector<std::weak_ptr<RenderSequenceHandler>> open_;
  bool draining_ = false;
};

// What all calls of a service share.
struct Shared {
  Shared(const Backend& the_backend, const Access& the_access)
      : backend(the_backend), access(the_access) {}

  const Backend backend;
  const Access& access;
  CallCount count;
  Timer timer;
  OpenSequences sequences;
};

std::chrono::seconds StallLimit(const Backend& backend) {
  return std::chrono::seconds(backend.limits.max_stall_seconds);
}

// What becomes of a call whose peer stalls.
std::function<void()> EndForStall(CallToken& token, const Backend& backend) {
  return [&token, limit = StallLimit(backend)] { token.EndForStall(limit); };
}

class UploadCall final : public grpc::ServerReadReactor<v1::UploadParticlesRequest> {
 public:
  UploadCall(Shared& shared, CallbackServerContext& context, v1::UploadParticlesResponse& response)
      : token_(Rpc::kUploadParticles, shared.count, shared.backend, shared.access, context),
        response_(response),
        handler_(shared.backend, token_.caller()),
        stall_(shared.timer, StallLimit(shared.backend), EndForStall(token_, shared.backend)) {
    if (!token_.refusal().ok()) {
      Answer(token_.refusal());
    } else {
      Read();
    }
  }

  void OnReadDone(bool ok) override {
    stall_.End();
    if (!ok) {
      Answer(handler_.OnEndOfRequests());
      return;
    }
    token_.OnReceived(request_.ByteSizeLong());
    if (const auto answer = handler_.OnRequest(request_)) {
      Answer(*answer);
    } else {
      Read();
    }
  }

  void OnDone() override { delete this; }

 private:
  void Read() {
    stall_.Begin();
    StartRead(&request_);
  }

  void Answer(const UploadParticlesHandler::Answer& answer) {
    if (answer.ok()) {
      response_ = *answer;
    }
    const grpc::Status status = token_.End(answer.status());
    stall_.Begin();  // of a peer that reads nothing: until OnDone the call counts
    Finish(status);
  }

  CallToken token_;
  v1::UploadParticlesResponse& response_;
  UploadParticlesHandler handler_;
  StallGuard stall_;
  v1::UploadParticlesRequest request_;
};

// What sends frames takes messages in bytes, so that chunks need not be copied into messages first.
template <typename Message>
std::optional<Message> Parse(grpc::ByteBuffer bytes) {
  Message message;
  if (!grpc::SerializationTraits<Message>::Deserialize(&bytes, &message).ok()) {
    return std::nullopt;
  }
  return message;
}

class RenderFrameCall final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                              public ResponseSink<v1::RenderFrameResponse> {
  using Reactor = grpc::ServerWriteReactor<grpc::ByteBuffer>;

 public:
  RenderFrameCall(Shared& shared, CallbackServerContext& context, const grpc::ByteBuffer& request)
      : request_(Parse<v1::RenderFrameRequest>(request)),
        token_(Rpc::kRenderFrame, shared.count, shared.backend, shared.access, context,
               request_.has_value() ? request_->request_id() : ""),
        stall_(shared.timer, StallLimit(shared.backend), EndForStall(token_, shared.backend)),
        handler_(std::make_shared<RenderFrameHandler>(shared.backend, *this, token_.caller())) {
    token_.OnReceived(request.Length());
    if (!token_.refusal().ok()) {
      RenderFrameCall::Finish(token_.refusal());
    } else if (!request_.has_value()) {
      RenderFrameCall::Finish(FieldError("message", "bytes that are none", "a RenderFrameRequest"));
    } else {
      handler_->Start(*std::exchange(request_, std::nullopt));
    }
  }

  void OnWriteDone(bool ok) override {
    stall_.End();
    token_.OnSent(ok ? response_.Length() : 0);
    handler_->OnWritten(ok);
  }
  void OnCancel() override { handler_->OnCancel(); }
  void OnDone() override { delete this; }

 private:
  void Write(const OutgoingMessage<v1::RenderFrameResponse>& outgoing) override {
    response_ = ToByteBuffer(outgoing);
    stall_.Begin();
    StartWrite(&response_);
  }
  void Finish(const absl::Status& status) override {
    const grpc::Status told = token_.End(status);
    stall_.Begin();
    Reactor::Finish(told);
  }

  std::optional<v1::RenderFrameRequest> request_;  // until the call begins
  CallToken token_;
  StallGuard stall_;
  const std::shared_ptr<RenderFrameHandler> handler_;
  grpc::ByteBuffer response_;
};

class RenderSequenceCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                                 public DuplexSink<v1::RenderSequenceResponse> {
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

 public:
  RenderSequenceCall(Shared& shared, CallbackServerContext& context)
      : token_(Rpc::kRenderSequence, shared.count, shared.backend, shared.access, context),
        stall_(shared.timer, StallLimit(shared.backend), EndForStall(token_, shared.backend)),
        handler_(std::make_shared<RenderSequenceHandler>(shared.backend, *this, token_.caller())) {
    if (!token_.refusal().ok()) {
      RenderSequenceCall::Finish(token_.refusal());
    } else {
      shared.sequences.Add(handler_);
      handler_->Start();
    }
  }

  void OnReadDone(bool ok) override {
    if (!ok) {
      handler_->OnEndOfRequests();
      return;
    }
    token_.OnReceived(request_.Length());
    if (const auto message = Parse<v1::RenderSequenceRequest>(request_)) {
      handler_->OnRequest(*message);
    } else {
      handler_->OnUnreadableRequest();
    }
  }
  void OnWriteDone(bool ok) override {
    stall_.End();
    token_.OnSent(ok ? response_.Length() : 0);
    handler_->OnWritten(ok);
  }
  void OnCancel() override { handler_->OnCancel(); }
  void OnDone() override { delete this; }

 private:
  void Read() override { StartRead(&request_); }
  void Write(const OutgoingMessage<v1::RenderSequenceResponse>& outgoing) override {
    response_ = ToByteBuffer(outgoing);
    stall_.Begin();
    StartWrite(&response_);
  }
  void Finish(const absl::Status& status) override {
    const grpc::Status told = token_.End(status);
    stall_.Begin();
    Reactor::Finish(told);
  }

  CallToken token_;
  StallGuard stall_;
  const std::shared_ptr<RenderSequenceHandler> handler_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
};

using Rpcs = v1::RenderService;
using CallbackService = Rpcs::WithCallbackMethod_GetServerInfo<
    Rpcs::WithCallbackMethod_FindMissingParticles<Rpcs::WithCallbackMethod_QueryUpload<
        Rpcs::WithCallbackMethod_UploadParticles<Rpcs::WithRawCallbackMethod_RenderFrame<
            Rpcs::WithRawCallbackMethod_RenderSequence<Rpcs::Service>>>>>>;

}  // namespace

class RenderService::Calls final : public CallbackService {
 public:
  Calls(const Backend& backend, const Access& access) : shared_(backend, access) {}

  CallCount& count() { return shared_.count; }

  void BeginDrain() {
    shared_.count.draining = true;
    shared_.sequences.Drain();
  }

  grpc::ServerUnaryReactor* GetServerInfo(CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override {
    return AnswerAtOnce(Rpc::kGetServerInfo, *context, *request, *response,
                        [&](const Caller& /*caller*/) -> absl::StatusOr<v1::GetServerInfoResponse> {
                          return halflight::GetServerInfo(shared_.backend);
                        });
  }

  grpc::ServerUnaryReactor* FindMissingParticles(
      CallbackServerContext* context, const v1::FindMissingParticlesRequest* request,
      v1::FindMissingParticlesResponse* response) override {
    return AnswerAtOnce(Rpc::kFindMissingParticles, *context, *request, *response,
                        [&](const Caller& /*caller*/) {
                          return halflight::FindMissingParticles(shared_.backend, *request);
                        });
  }

  grpc::ServerUnaryReactor* QueryUpload(CallbackServerContext* context,
                                        const v1::QueryUploadRequest* request,
                                        v1::QueryUploadResponse* response) override {
    return AnswerAtOnce(Rpc::kQueryUpload, *context, *request, *response,
                        [&](const Caller& caller) {
                          return halflight::QueryUpload(shared_.backend, *request, caller);
                        });
  }

  grpc::ServerReadReactor<v1::UploadParticlesRequest>* UploadParticles(
      CallbackServerContext* context, v1::UploadParticlesResponse* response) override {
    return new UploadCall(shared_, *context, *response);
  }

  grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderFrame(
      CallbackServerContext* context, const grpc::ByteBuffer* request) override {
    return new RenderFrameCall(shared_, *context, *request);
  }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* RenderSequence(
      CallbackServerContext* context) override {
    return new RenderSequenceCall(shared_, *context);
  }

 private:
  template <typename Request, typename Response, typename Handler>
  grpc::ServerUnaryReactor* AnswerAtOnce(Rpc rpc, CallbackServerContext& context,
                                         const Request& request, Response& response,
                                         const Handler& handler) {
    grpc::Status status;
    {
      // Gone before the call is finished, which may take the context along.
      CallToken token(rpc, shared_.count, shared_.backend, shared_.access, context);
      token.OnReceived(request.ByteSizeLong());
      absl::Status outcome = token.refusal();
      if (outcome.ok()) {
        auto answer = handler(token.caller());
        outcome = answer.status();
        if (answer.ok()) {
          response = *std::move(answer);
          token.OnSent(response.ByteSizeLong());
        }
      }
      status = token.End(outcome);
    }
    grpc::ServerUnaryReactor* const reactor = context.DefaultReactor();
    reactor->Finish(status);
    return reactor;
  }

  Shared shared_;
};

RenderService::RenderService(const Backend& backend, const Access& access)
    : calls_(std::make_unique<Calls>(backend, access)) {}

RenderService::~RenderService() = default;

grpc::Service& RenderService::grpc_service() { return *calls_; }

void RenderService::BeginDrain() { calls_->BeginDrain(); }

int RenderService::active_calls() const { return calls_->count().active; }

int RenderService::active_calls(Rpc rpc) const {
  return calls_->count().active_of[static_cast<size_t>(rpc)];
}

uint64_t RenderService::calls_begun() const { return calls_->count().begun; }

}  // namespace halflight
