#include "server/stream_calls.h"

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "renderer/field_error.h"
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

std::chrono::seconds StallLimit(const Backend& backend) {
  return std::chrono::seconds(backend.limits.max_stall_seconds);
}

// What becomes of a call whose peer stalls.
std::function<void()> EndForStall(CallToken& token, const Backend& backend) {
  return [&token, limit = StallLimit(backend)] { token.EndForStall(limit); };
}

class UploadCall final : public grpc::ServerReadReactor<v1::UploadParticlesRequest> {
 public:
  UploadCall(SharedByCalls& shared, CallbackServerContext& context,
             v1::UploadParticlesResponse& response)
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
  // A sequence keeps what it is sent, which is bounded by what is known.
  message.DiscardUnknownFields();
  return message;
}

class RenderFrameCall final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                              public ResponseSink<v1::RenderFrameResponse> {
  using Reactor = grpc::ServerWriteReactor<grpc::ByteBuffer>;

 public:
  RenderFrameCall(SharedByCalls& shared, CallbackServerContext& context,
                  const grpc::ByteBuffer& request)
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
  RenderSequenceCall(SharedByCalls& shared, CallbackServerContext& context)
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
  void OnCancel() override {
    // One that is refused is finished already, and its handler knows nothing of it.
    if (token_.refusal().ok()) {
      handler_->OnCancel();
    }
  }
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

}  // namespace

grpc::ServerReadReactor<v1::UploadParticlesRequest>* NewUploadCall(
    SharedByCalls& shared, CallbackServerContext& context, v1::UploadParticlesResponse& response) {
  return new UploadCall(shared, context, response);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* NewRenderFrameCall(SharedByCalls& shared,
                                                               CallbackServerContext& context,
                                                               const grpc::ByteBuffer& request) {
  return new RenderFrameCall(shared, context, request);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* NewRenderSequenceCall(
    SharedByCalls& shared, CallbackServerContext& context) {
  return new RenderSequenceCall(shared, context);
}

}  // namespace halflight
