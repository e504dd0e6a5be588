// The one place where an absl::Status becomes a gRPC status. The other direction is the client's.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace halflight {

// Also leaves the retry hint, if the error has one, in the call's trailing metadata under
// "grpc-retry-pushback-ms", which gRPC clients with a retry policy obey. Call it right before
// Finish.
grpc::Status ToGrpc(const absl::Status& status, grpc::CallbackServerContext& context);

}  // namespace halflight
