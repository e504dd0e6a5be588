// The RPCs that stream, as gRPC's reactors: each passes messages between its peer and a handler,
// ends a peer that stalls, and goes with its call. What the calls do stands in handlers/.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "halflight/v1/service.grpc.pb.h"
#include "server/shared_by_calls.h"

namespace halflight {

// Each deletes itself when its call has ended; `shared` outlives it. The bytes of a request are let
// go of, which gRPC would keep as long as the call.
grpc::ServerReadReactor<grpc::ByteBuffer>* NewUploadCall(SharedByCalls& shared,
                                                         grpc::CallbackServerContext& context,
                                                         grpc::ByteBuffer& response);
grpc::ServerWriteReactor<grpc::ByteBuffer>* NewRenderFrameCall(SharedByCalls& shared,
                                                               grpc::CallbackServerContext& context,
                                                               grpc::ByteBuffer& request);
grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* NewRenderSequenceCall(
    SharedByCalls& shared, grpc::CallbackServerContext& context);

}  // namespace halflight
