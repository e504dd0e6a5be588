#include "server/render_service.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "absl/status/status.h"
#include "halflight/v1/service.grpc.pb.h"
#include "server/caller.h"
#include "server/error_detail.h"
#include "server/handlers/find_missing_particles.h"
#include "server/handlers/get_server_info.h"
#include "server/handlers/query_upload.h"
#include "server/handlers/render_frame.h"
#include "server/handlers/render_sequence.h"
#include "server/handlers/upload_particles.h"
#include "server/message_buffer.h"
#include "server/stall_guard.h"
#include "server/status_to_grpc.h"

// The callback API deletes a reactor in OnDone, which comes after Finish and after every reaction
// has returned. So a reactor never touches itself after Finish other than by returning, and
// whatever may outlast the call (a handler that the pipeline still holds) is shared and leaves its
// sink alone once it has finished it.

namespace halflight {
namespace {

using grpc::CallbackServerContext;

// How many calls are under way, and whether more may come.
struct CallCount {
  std::atomic<int> active = 0;
  std::atomic<uint64_t> begun = 0;
  std::atomic<bool> draining = false;
};

// One call under way, and whose it is. Counted before draining is looked at, so that whoever drains
// and then sees no calls can be sure that none slips in.
class CallToken {
 public:
  CallToken(CallCount& count, const ServerLimits& limits, const Access& access,
            const CallbackServerContext& context)
      : count_(count) {
    ++count_.begun;
    if (++count_.active > static_cast<int64_t>(limits.max_calls)) {
      refusal_ = BusyError(v1::ERROR_REASON_TOO_MANY_CALLS,
                           fmt::format("{} calls are under way, allowed: at most {}: retry later",
                                       count_.active - 1, limits.max_calls));
      return;
    }
    if (count_.draining) {
      refusal_ = WithReason(
          absl::UnavailableError("the server is shutting down: retry elsewhere or later"),
          v1::ERROR_REASON_DRAINING);
      return;
    }
    auto caller = access.Identify(context);
    if (caller.ok()) {
      caller_ = *std::move(caller);
    } else {
      refusal_ = WithReason(caller.status(), v1::ERROR_REASON_UNAUTHENTICATED);
    }
  }
  ~CallToken() { --count_.active; }
  CallToken(const CallToken&) = delete;
  CallToken& operator=(const CallToken&) = delete;
  CallToken(CallToken&&) = delete;
  CallToken& operator=(CallToken&&) = delete;

  // Why the call is not served, or OK.
  [[nodiscard]] const absl::Status& refusal() const { return refusal_; }
  // Nobody where it is refused.
  [[nodiscard]] const Caller& caller() const { return caller_; }

 private:
  CallCount& count_;
  absl::Status refusal_;
  Caller caller_;
};

// What all calls of a service share.
struct Shared {
  Shared(const Backend& the_backend, const Access& the_access)
      : backend(the_backend), access(the_access) {}

  const Backend backend;
  const Access& access;
  CallCount count;
  Timer timer;
};

std::chrono::seconds StallLimit(const Backend& backend) {
  return std::chrono::seconds(backend.limits.max_stall_seconds);
}

// What becomes of a call whose peer stalls.
std::function<void()> Cancelling(const Backend& backend, CallbackServerContext& context) {
  return [&context, seconds = backend.limits.max_stall_seconds] {
    spdlog::warn("call stalled peer={} seconds={}", context.peer(), seconds);
    context.TryCancel();
  };
}

class UploadCall final : public grpc::ServerReadReactor<v1::UploadParticlesRequest> {
 public:
  UploadCall(Shared& shared, CallbackServerContext& context, v1::UploadParticlesResponse& response)
      : token_(shared.count, shared.backend.limits, shared.access, context),
        context_(context),
        response_(response),
        handler_(shared.backend),
        stall_(shared.timer, StallLimit(shared.backend), Cancelling(shared.backend, context)) {
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
    Finish(ToGrpc(answer.status(), context_));
  }

  const CallToken token_;
  CallbackServerContext& context_;
  v1::UploadParticlesResponse& response_;
  UploadParticlesHandler handler_;
  StallGuard stall_;
  v1::UploadParticlesRequest request_;
};

// What sends frames takes messages in bytes, so that chunks need not be copied into messages first.
template <typename Message>
bool Parse(grpc::ByteBuffer bytes, Message& message) {
  return grpc::SerializationTraits<Message>::Deserialize(&bytes, &message).ok();
}

class RenderFrameCall final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                              public ResponseSink<v1::RenderFrameResponse> {
  using Reactor = grpc::ServerWriteReactor<grpc::ByteBuffer>;

 public:
  RenderFrameCall(Shared& shared, CallbackServerContext& context, const grpc::ByteBuffer& request)
      : token_(shared.count, shared.backend.limits, shared.access, context),
        context_(context),
        stall_(shared.timer, StallLimit(shared.backend), Cancelling(shared.backend, context)),
        handler_(std::make_shared<RenderFrameHandler>(shared.backend, *this, token_.caller())) {
    if (v1::RenderFrameRequest message; !token_.refusal().ok()) {
      RenderFrameCall::Finish(token_.refusal());
    } else if (!Parse(request, message)) {
      RenderFrameCall::Finish(
          absl::InvalidArgumentError("the message is not a RenderFrameRequest"));
    } else {
      handler_->Start(message);
    }
  }

  void OnWriteDone(bool ok) override {
    stall_.End();
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
  void Finish(const absl::Status& status) override { Reactor::Finish(ToGrpc(status, context_)); }

  const CallToken token_;
  CallbackServerContext& context_;
  StallGuard stall_;
  const std::shared_ptr<RenderFrameHandler> handler_;
  grpc::ByteBuffer response_;
};

class RenderSequenceCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                                 public DuplexSink<v1::RenderSequenceResponse> {
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

 public:
  RenderSequenceCall(Shared& shared, CallbackServerContext& context)
      : token_(shared.count, shared.backend.limits, shared.access, context),
        context_(context),
        stall_(shared.timer, StallLimit(shared.backend), Cancelling(shared.backend, context)),
        handler_(std::make_shared<RenderSequenceHandler>(shared.backend, *this, token_.caller())) {
    if (!token_.refusal().ok()) {
      RenderSequenceCall::Finish(token_.refusal());
    } else {
      handler_->Start();
    }
  }

  void OnReadDone(bool ok) override {
    if (v1::RenderSequenceRequest message; !ok) {
      handler_->OnEndOfRequests();
    } else if (!Parse(request_, message)) {
      handler_->OnUnreadableRequest();
    } else {
      handler_->OnRequest(message);
    }
  }
  void OnWriteDone(bool ok) override {
    stall_.End();
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
  void Finish(const absl::Status& status) override { Reactor::Finish(ToGrpc(status, context_)); }

  const CallToken token_;
  CallbackServerContext& context_;
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

  grpc::ServerUnaryReactor* GetServerInfo(CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* /*request*/,
                                          v1::GetServerInfoResponse* response) override {
    return AnswerAtOnce(*context, *response, [&]() -> absl::StatusOr<v1::GetServerInfoResponse> {
      return halflight::GetServerInfo(shared_.backend);
    });
  }

  grpc::ServerUnaryReactor* FindMissingParticles(
      CallbackServerContext* context, const v1::FindMissingParticlesRequest* request,
      v1::FindMissingParticlesResponse* response) override {
    return AnswerAtOnce(*context, *response,
                        [&] { return halflight::FindMissingParticles(shared_.backend, *request); });
  }

  grpc::ServerUnaryReactor* QueryUpload(CallbackServerContext* context,
                                        const v1::QueryUploadRequest* request,
                                        v1::QueryUploadResponse* response) override {
    return AnswerAtOnce(*context, *response,
                        [&] { return halflight::QueryUpload(shared_.backend, *request); });
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
  template <typename Response, typename Handler>
  grpc::ServerUnaryReactor* AnswerAtOnce(CallbackServerContext& context, Response& response,
                                         const Handler& handler) {
    const CallToken token(shared_.count, shared_.backend.limits, shared_.access, context);
    absl::Status status = token.refusal();
    if (status.ok()) {
      auto answer = handler();
      status = answer.status();
      if (answer.ok()) {
        response = *std::move(answer);
      }
    }
    grpc::ServerUnaryReactor* const reactor = context.DefaultReactor();
    reactor->Finish(ToGrpc(status, context));
    return reactor;
  }

  Shared shared_;
};

RenderService::RenderService(const Backend& backend, const Access& access)
    : calls_(std::make_unique<Calls>(backend, access)) {}

RenderService::~RenderService() = default;

grpc::Service& RenderService::grpc_service() { return *calls_; }

void RenderService::BeginDrain() { calls_->count().draining = true; }

int RenderService::active_calls() const { return calls_->count().active; }

uint64_t RenderService::calls_begun() const { return calls_->count().begun; }

}  // namespace halflight
