// A call that is answered at once, as gRPC's reactor: it counts until its peer has the answer, and
// ends a peer that does not take it.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "absl/status/statusor.h"
#include "server/call_token.h"
#include "server/message_buffer.h"
#include "server/shared_by_calls.h"
#include "server/stall_guard.h"

namespace halflight {

// Deletes itself when its call has ended; `shared` outlives it.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  UnaryCall(Rpc rpc, SharedByCalls& shared, grpc::CallbackServerContext& context)
      : token_(rpc, shared.count, shared.backend, shared.access, context),
        stall_(shared.timer, shared.patience(), shared.StallEnder(token_)) {}

  // Once, last. `handler`: from a request and its caller to an absl::StatusOr of the response. The
  // bytes of the request are let go of, which gRPC would keep as long as the call.
  template <typename Request, typename Handler>
  void Answer(grpc::ByteBuffer& request, grpc::ByteBuffer& response, const Handler& handler) {
    token_.OnReceived(request.Length());
    absl::Status outcome = token_.refusal();
    if (outcome.ok()) {
      outcome = Respond(TakeMessage<Request>(request), response, handler);
    }
    request.Clear();
    const grpc::Status status = token_.End(outcome);
    stall_.Begin();
    Finish(status);
  }

  void OnDone() override { delete this; }

 private:
  template <typename Request, typename Handler>
  absl::Status Respond(const absl::StatusOr<Request>& request, grpc::ByteBuffer& response,
                       const Handler& handler) {
    if (!request.ok()) {
      return request.status();
    }
    const auto answer = handler(*request, token_.caller());
    if (answer.ok()) {
      response = ToByteBuffer(*answer);
      token_.OnSent(response.Length());
    }
    return answer.status();
  }

  CallToken token_;
  StallGuard stall_;
};

}  // namespace halflight
