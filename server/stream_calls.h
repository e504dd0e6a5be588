// The RPCs that stream, as gRPC's reactors: each passes messages between its peer and a handler,
// ends a peer that stalls, and goes with its call. What the calls do stands in handlers/.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "halflight/v1/service.grpc.pb.h"
#include "server/call_token.h"
#include "server/handlers/backend.h"
#include "server/open_sequences.h"
#include "server/timer.h"

namespace halflight {

// What all calls of a service share.
struct SharedByCalls {
  SharedByCalls(const Backend& the_backend, const Access& the_access)
      : backend(the_backend), access(the_access) {}

  const Backend backend;
  const Access& access;
  CallCount count;
  Timer timer;
  OpenSequences sequences;
};

// Each deletes itself when its call has ended; `shared` outlives it.
grpc::ServerReadReactor<v1::UploadParticlesRequest>* NewUploadCall(
    SharedByCalls& shared, grpc::CallbackServerContext& context,
    v1::UploadParticlesResponse& response);
grpc::ServerWriteReactor<grpc::ByteBuffer>* NewRenderFrameCall(SharedByCalls& shared,
                                                               grpc::CallbackServerContext& context,
                                                               const grpc::ByteBuffer& request);
grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* NewRenderSequenceCall(
    SharedByCalls& shared, grpc::CallbackServerContext& context);

}  // namespace halflight
