#include "server/render_service.h"

#include <atomic>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "halflight/v1/service.grpc.pb.h"
#include "server/handlers/find_missing_particles.h"
#include "server/handlers/get_server_info.h"
#include "server/handlers/render_frame.h"
#include "server/handlers/render_sequence.h"
#include "server/handlers/upload_particles.h"
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
class CallEntry {
 public:
  CallEntry(CallCount& count, const Access& access, const CallbackServerContext& context)
      : count_(count), caller_(Enter(count, access, context)) {}
  ~CallEntry() { --count_.active; }
  CallEntry(const CallEntry&) = delete;
  CallEntry& operator=(const CallEntry&) = delete;
  CallEntry(CallEntry&&) = delete;
  CallEntry& operator=(CallEntry&&) = delete;

  // OK, or what the call has to end with.
  [[nodiscard]] const absl::Status& admission() const { return caller_.status(); }
  // Nobody where it is not admitted.
  [[nodiscard]] Caller caller() const { return caller_.ok() ? *caller_ : Caller(); }

 private:
  static absl::StatusOr<Caller> Enter(CallCount& count, const Access& access,
                                      const CallbackServerContext& context) {
    ++count.active;
    ++count.begun;
    if (count.draining) {
      return absl::UnavailableError("the server is shutting down: retry elsewhere or later");
    }
    return access.Identify(context);
  }

  CallCount& count_;
  const absl::StatusOr<Caller> caller_;
};

// What the calls of the service share. References: the service has them.
struct Shared {
  const Backend& backend;
  const Access& access;
  CallCount& count;
};

class UploadCall final : public grpc::ServerReadReactor<v1::UploadParticlesRequest> {
 public:
  UploadCall(const Shared& shared, CallbackServerContext& context,
             v1::UploadParticlesResponse& response)
      : entry_(shared.count, shared.access, context),
        context_(context),
        response_(response),
        handler_(shared.backend) {
    if (!entry_.admission().ok()) {
      Answer(entry_.admission());
    } else {
      StartRead(&request_);
    }
  }

  void OnReadDone(bool ok) override {
    if (!ok) {
      Answer(handler_.OnEndOfRequests());
      return;
    }
    if (const auto answer = handler_.OnRequest(request_)) {
      Answer(*answer);
    } else {
      StartRead(&request_);
    }
  }

  void OnDone() override { delete this; }

 private:
  void Answer(const UploadParticlesHandler::Answer& answer) {
    if (answer.ok()) {
      response_ = *answer;
    }
    Finish(ToGrpc(answer.status(), context_));
  }

  const CallEntry entry_;
  CallbackServerContext& context_;
  v1::UploadParticlesResponse& response_;
  UploadParticlesHandler handler_;
  v1::UploadParticlesRequest request_;
};

class RenderFrameCall final : public grpc::ServerWriteReactor<v1::RenderFrameResponse>,
                              public ResponseSink<v1::RenderFrameResponse> {
  using Reactor = grpc::ServerWriteReactor<v1::RenderFrameResponse>;

 public:
  RenderFrameCall(const Shared& shared, CallbackServerContext& context,
                  const v1::RenderFrameRequest& request)
      : entry_(shared.count, shared.access, context),
        context_(context),
        handler_(std::make_shared<RenderFrameHandler>(shared.backend, *this, entry_.caller())) {
    if (!entry_.admission().ok()) {
      RenderFrameCall::Finish(entry_.admission());
    } else {
      handler_->Start(request);
    }
  }

  void OnWriteDone(bool ok) override { handler_->OnWritten(ok); }
  void OnCancel() override { handler_->OnCancel(); }
  void OnDone() override { delete this; }

 private:
  void Write(const v1::RenderFrameResponse& message) override { StartWrite(&message); }
  void Finish(const absl::Status& status) override { Reactor::Finish(ToGrpc(status, context_)); }

  const CallEntry entry_;
  CallbackServerContext& context_;
  const std::shared_ptr<RenderFrameHandler> handler_;
};

class RenderSequenceCall final
    : public grpc::ServerBidiReactor<v1::RenderSequenceRequest, v1::RenderSequenceResponse>,
      public DuplexSink<v1::RenderSequenceResponse> {
  using Reactor = grpc::ServerBidiReactor<v1::RenderSequenceRequest, v1::RenderSequenceResponse>;

 public:
  RenderSequenceCall(const Shared& shared, CallbackServerContext& context)
      : entry_(shared.count, shared.access, context),
        context_(context),
        handler_(std::make_shared<RenderSequenceHandler>(shared.backend, *this, entry_.caller())) {
    if (!entry_.admission().ok()) {
      RenderSequenceCall::Finish(entry_.admission());
    } else {
      handler_->Start();
    }
  }

  void OnReadDone(bool ok) override {
    if (ok) {
      handler_->OnRequest(request_);
    } else {
      handler_->OnEndOfRequests();
    }
  }
  void OnWriteDone(bool ok) override { handler_->OnWritten(ok); }
  void OnCancel() override { handler_->OnCancel(); }
  void OnDone() override { delete this; }

 private:
  void Read() override { StartRead(&request_); }
  void Write(const v1::RenderSequenceResponse& message) override { StartWrite(&message); }
  void Finish(const absl::Status& status) override { Reactor::Finish(ToGrpc(status, context_)); }

  const CallEntry entry_;
  CallbackServerContext& context_;
  const std::shared_ptr<RenderSequenceHandler> handler_;
  v1::RenderSequenceRequest request_;
};

}  // namespace

class RenderService::Calls final : public v1::RenderService::CallbackService {
 public:
  Calls(const Backend& backend, const Access& access) : backend_(backend), access_(access) {}

  CallCount& count() { return count_; }

  grpc::ServerUnaryReactor* GetServerInfo(CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* /*request*/,
                                          v1::GetServerInfoResponse* response) override {
    return AnswerAtOnce(*context, *response, [&]() -> absl::StatusOr<v1::GetServerInfoResponse> {
      return halflight::GetServerInfo(backend_);
    });
  }

  grpc::ServerUnaryReactor* FindMissingParticles(
      CallbackServerContext* context, const v1::FindMissingParticlesRequest* request,
      v1::FindMissingParticlesResponse* response) override {
    return AnswerAtOnce(*context, *response,
                        [&] { return halflight::FindMissingParticles(backend_, *request); });
  }

  grpc::ServerReadReactor<v1::UploadParticlesRequest>* UploadParticles(
      CallbackServerContext* context, v1::UploadParticlesResponse* response) override {
    return new UploadCall(shared_, *context, *response);
  }

  grpc::ServerWriteReactor<v1::RenderFrameResponse>* RenderFrame(
      CallbackServerContext* context, const v1::RenderFrameRequest* request) override {
    return new RenderFrameCall(shared_, *context, *request);
  }

  grpc::ServerBidiReactor<v1::RenderSequenceRequest, v1::RenderSequenceResponse>* RenderSequence(
      CallbackServerContext* context) override {
    return new RenderSequenceCall(shared_, *context);
  }

 private:
  template <typename Response, typename Handler>
  grpc::ServerUnaryReactor* AnswerAtOnce(CallbackServerContext& context, Response& response,
                                         const Handler& handler) {
    const CallEntry entry(count_, access_, context);
    absl::Status status = entry.admission();
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

  const Backend backend_;
  const Access& access_;
  CallCount count_;
  const Shared shared_{backend_, access_, count_};
};

RenderService::RenderService(const Backend& backend, const Access& access)
    : calls_(std::make_unique<Calls>(backend, access)) {}

RenderService::~RenderService() = default;

grpc::Service& RenderService::grpc_service() { return *calls_; }

void RenderService::BeginDrain() { calls_->count().draining = true; }

int RenderService::active_calls() const { return calls_->count().active; }

uint64_t RenderService::calls_begun() const { return calls_->count().begun; }

}  // namespace halflight
