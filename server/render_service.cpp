#include "server/render_service.h"

#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "halflight/v1/service.grpc.pb.h"
#include "server/handlers/find_missing_particles.h"
#include "server/handlers/get_server_info.h"
#include "server/handlers/query_upload.h"
#include "server/stream_calls.h"

namespace halflight {
namespace {

using grpc::CallbackServerContext;

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
    return NewUploadCall(shared_, *context, *response);
  }

  grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderFrame(
      CallbackServerContext* context, const grpc::ByteBuffer* request) override {
    return NewRenderFrameCall(shared_, *context, *request);
  }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* RenderSequence(
      CallbackServerContext* context) override {
    return NewRenderSequenceCall(shared_, *context);
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

  SharedByCalls shared_;
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
