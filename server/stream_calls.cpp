#include "server/stream_calls.h"

#include <memory>
#include <string>
#include <utility>

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

class UploadCall final : public grpc::ServerReadReactor<grpc::ByteBuffer> {
 public:
  UploadCall(SharedByCalls& shared, CallbackServerContext& context, grpc::ByteBuffer& response)
      : token_(Rpc::kUploadParticles, shared.count, shared.backend, shared.access, context),
        response_(response),
        handler_(shared.backend, token_.caller()),
        stall_(shared.timer, shared.patience(), shared.StallEnder(token_)) {
    if (!token_.refusal().ok()) {
      Answer(token_.refusal());
    } else {
      Read();
    }
  }

  void OnReadDone(bool ok) override {
    stall_.End(ok ? request_.Length() : 0);
    if (!ok) {
      Answer(handler_.OnEndOfRequests());
      return;
    }
    token_.OnReceived(request_.Length());
    const auto request = TakeMessage<v1::UploadParticlesRequest>(request_);
    if (!request.ok()) {
      Answer(handler_.OnUnreadableRequest(request.status()));
    } else if (const auto answer = handler_.OnRequest(*request)) {
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
      response_ = ToByteBuffer(*answer);
    }
    const grpc::Status status = token_.End(answer.status());
    stall_.Restore();
    stall_.Begin();  // of a peer that reads nothing: until OnDone the call counts
    Finish(status);
  }

  CallToken token_;
  grpc::ByteBuffer& response_;
  UploadParticlesHandler handler_;
  StallGuard stall_;
  grpc::ByteBuffer request_;
};

// A call that sends frames: what both kinds have in common.
template <typename Reactor, template <typename> typename Sink, typename Response, typename Handler>
class SendingCall : public Reactor, public Sink<Response> {
 public:
  void OnWriteDone(bool ok) override {
    const size_t sent = ok ? response_.Length() : 0;
    stall_.End(sent);
    token_.OnSent(sent);
    handler_->OnWritten(ok);
  }
  void OnCancel() override {
    // One that is refused is finished already, and its handler knows nothing of it.
    if (token_.refusal().ok()) {
      handler_->OnCancel();
    }
  }
  void OnDone() override { delete this; }

 protected:
  SendingCall(Rpc rpc, SharedByCalls& shared, CallbackServerContext& context,
              const std::string& request_id)
      : token_(rpc, shared.count, shared.backend, shared.access, context, request_id),
        stall_(shared.timer, shared.patience(), shared.StallEnder(token_)),
        handler_(std::make_shared<Handler>(shared.backend, *this, token_.caller())) {}

  void Write(const OutgoingMessage<Response>& outgoing) override {
    response_ = ToByteBuffer(outgoing);
    if (outgoing.message.has_header()) {
      stall_.Restore();
    }
    stall_.Begin();
    this->StartWrite(&response_);
  }
  void Finish(const absl::Status& status) override {
    const grpc::Status told = token_.End(status);
    stall_.Restore();
    stall_.Begin();
    Reactor::Finish(told);
  }

  CallToken token_;
  StallGuard stall_;
  const std::shared_ptr<Handler> handler_;

 private:
  grpc::ByteBuffer response_;
};

class RenderFrameCall final
    : public SendingCall<grpc::ServerWriteReactor<grpc::ByteBuffer>, ResponseSink,
                         v1::RenderFrameResponse, RenderFrameHandler> {
 public:
  RenderFrameCall(SharedByCalls& shared, CallbackServerContext& context, size_t request_bytes,
                  const absl::StatusOr<v1::RenderFrameRequest>& request)
      : SendingCall(Rpc::kRenderFrame, shared, context, request.ok() ? request->request_id() : "") {
    token_.OnReceived(request_bytes);
    if (!token_.refusal().ok()) {
      RenderFrameCall::Finish(token_.refusal());
    } else if (!request.ok()) {
      RenderFrameCall::Finish(request.status());
    } else {
      handler_->Start(*request);
    }
  }
};

class RenderSequenceCall final
    : public SendingCall<grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>, DuplexSink,
                         v1::RenderSequenceResponse, RenderSequenceHandler> {
 public:
  RenderSequenceCall(SharedByCalls& shared, CallbackServerContext& context)
      : SendingCall(Rpc::kRenderSequence, shared, context, "") {
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
    if (auto message = TakeMessage<v1::RenderSequenceRequest>(request_); message.ok()) {
      // It keeps what it is sent, which is bounded by what is known.
      message->DiscardUnknownFields();
      handler_->OnRequest(*std::move(message));
    } else {
      handler_->OnUnreadableRequest(message.status());
    }
  }

 private:
  void Read() override { StartRead(&request_); }

  grpc::ByteBuffer request_;
};

}  // namespace

grpc::ServerReadReactor<grpc::ByteBuffer>* NewUploadCall(SharedByCalls& shared,
                                                         CallbackServerContext& context,
                                                         grpc::ByteBuffer& response) {
  return new UploadCall(shared, context, response);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* NewRenderFrameCall(SharedByCalls& shared,
                                                               CallbackServerContext& context,
                                                               grpc::ByteBuffer& request) {
  const size_t bytes = request.Length();
  return new RenderFrameCall(shared, context, bytes, TakeMessage<v1::RenderFrameRequest>(request));
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* NewRenderSequenceCall(
    SharedByCalls& shared, CallbackServerContext& context) {
  return new RenderSequenceCall(shared, context);
}

}  // namespace halflight
