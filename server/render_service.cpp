#include "server/render_service.h"

#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "halflight/v1/service.grpc.pb.h"
#include "server/handlers/find_missing_particles.h"
#include "server/handlers/get_server_info.h"
#include "server/handlers/query_upload.h"
#include "server/stream_calls.h"
#include "server/unary_call.h"

namespace halflight {
namespace {

using grpc::ByteBuffer;
using grpc::CallbackServerContext;

using Rpcs = v1::RenderService;
// All in bytes: what is read of them is bounded, and what is sent need not be copied.
using CallbackService = Rpcs::WithRawCallbackMethod_GetServerInfo<
    Rpcs::WithRawCallbackMethod_FindMissingParticles<Rpcs::WithRawCallbackMethod_QueryUpload<
        Rpcs::WithRawCallbackMethod_UploadParticles<Rpcs::WithRawCallbackMethod_RenderFrame<
            Rpcs::WithRawCallbackMethod_RenderSequence<Rpcs::Service>>>>>>;

// gRPC made it for the call, and looks at it no more.
ByteBuffer& Own(const ByteBuffer* request) { return *const_cast<ByteBuffer*>(request); }

}  // namespace

class RenderService::Calls final : public CallbackService {
 public:
  Calls(const Backend& backend, const Access& access, Connections& connections)
      : shared_(backend, access, connections) {}

  CallCount& count() { return shared_.count; }

  void BeginDrain() {
    shared_.count.draining = true;
    shared_.sequences.Drain();
  }

  grpc::ServerUnaryReactor* GetServerInfo(CallbackServerContext* context, const ByteBuffer* request,
                                          ByteBuffer* response) override {
    return Answer<v1::GetServerInfoRequest>(
        Rpc::kGetServerInfo, *context, request, *response,
        [this](const auto& /*message*/,
               const Caller& /*caller*/) -> absl::StatusOr<v1::GetServerInfoResponse> {
          return halflight::GetServerInfo(shared_.backend);
        });
  }

  grpc::ServerUnaryReactor* FindMissingParticles(CallbackServerContext* context,
                                                 const ByteBuffer* request,
                                                 ByteBuffer* response) override {
    return Answer<v1::FindMissingParticlesRequest>(
        Rpc::kFindMissingParticles, *context, request, *response,
        [this](const auto& message, const Caller& /*caller*/) {
          return halflight::FindMissingParticles(shared_.backend, message);
        });
  }

  grpc::ServerUnaryReactor* QueryUpload(CallbackServerContext* context, const ByteBuffer* request,
                                        ByteBuffer* response) override {
    return Answer<v1::QueryUploadRequest>(Rpc::kQueryUpload, *context, request, *response,
                                          [this](const auto& message, const Caller& caller) {
                                            return halflight::QueryUpload(shared_.backend, message,
                                                                          caller);
                                          });
  }

  grpc::ServerReadReactor<ByteBuffer>* UploadParticles(CallbackServerContext* context,
                                                       ByteBuffer* response) override {
    return NewUploadCall(shared_, *context, *response);
  }

  grpc::ServerWriteReactor<ByteBuffer>* RenderFrame(CallbackServerContext* context,
                                                    const ByteBuffer* request) override {
    return NewRenderFrameCall(shared_, *context, Own(request));
  }

  grpc::ServerBidiReactor<ByteBuffer, ByteBuffer>* RenderSequence(
      CallbackServerContext* context) override {
    return NewRenderSequenceCall(shared_, *context);
  }

 private:
  template <typename Request, typename Handler>
  grpc::ServerUnaryReactor* Answer(Rpc rpc, CallbackServerContext& context,
                                   const ByteBuffer* request, ByteBuffer& response,
                                   const Handler& handler) {
    auto* const call = new UnaryCall(rpc, shared_, context);
    call->Answer<Request>(Own(request), response, handler);
    return call;
  }

  SharedByCalls shared_;
};

RenderService::RenderService(const Backend& backend, const Access& access, Connections& connections)
    : calls_(std::make_unique<Calls>(backend, access, connections)) {}

RenderService::~RenderService() = default;

grpc::Service& RenderService::grpc_service() { return *calls_; }

void RenderService::BeginDrain() { calls_->BeginDrain(); }

int RenderService::served_calls() const { return calls_->count().served; }

int RenderService::active_calls(Rpc rpc) const {
  return calls_->count().active_of[static_cast<size_t>(rpc)];
}

uint64_t RenderService::calls_begun() const { return calls_->count().begun; }

}  // namespace halflight
