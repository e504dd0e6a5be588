#include "server/status_to_grpc.h"

#include <optional>
#include <string>

#include "server/retry_hint.h"
#include "server/status_text.h"

namespace halflight {

// Abseil's codes are gRPC's by definition; these two would be the first to move.
static_assert(static_cast<int>(absl::StatusCode::kDataLoss) == grpc::StatusCode::DATA_LOSS);
static_assert(static_cast<int>(absl::StatusCode::kUnauthenticated) ==
              grpc::StatusCode::UNAUTHENTICATED);

grpc::Status ToGrpc(const absl::Status& status, grpc::CallbackServerContext& context) {
  if (status.ok()) {
    return grpc::Status::OK;
  }
  if (const auto hint = RetryHint(status)) {
    context.AddTrailingMetadata("grpc-retry-pushback-ms", std::to_string(hint->count()));
  }
  return {static_cast<grpc::StatusCode>(status.code()), MessageOf(status)};
}

}  // namespace halflight
