// The one place where an absl::Status becomes a gRPC status. The other direction is the client's.
#pragma once

#include <string>

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace halflight {

// The google.rpc.Status that error.proto describes; empty for an error that has nothing to add.
std::string SerializedDetails(const absl::Status& status);

// With those details. Also leaves the time to wait, if the error has one, in the call's trailing
// metadata under "grpc-retry-pushback-ms", which gRPC clients with a retry policy obey. Call it
// right before Finish.
grpc::Status ToGrpc(const absl::Status& status, grpc::CallbackServerContext& context);

}  // namespace halflight
