#include "server/status_to_grpc.h"

#include <string>

#include <fmt/format.h>

#include "halflight/rpc_status.pb.h"
#include "server/error_detail.h"
#include "server/status_text.h"

namespace halflight {
namespace {

// Abseil's codes are gRPC's by definition; these two would be the first to move.
static_assert(static_cast<int>(absl::StatusCode::kDataLoss) == grpc::StatusCode::DATA_LOSS);
static_assert(static_cast<int>(absl::StatusCode::kUnauthenticated) ==
              grpc::StatusCode::UNAUTHENTICATED);

// With the name that other programs know the message by.
void AddDetail(rpc::Status& status, const char* name, const google::protobuf::Message& detail) {
  google::protobuf::Any& any = *status.add_details();
  any.set_type_url(fmt::format("type.googleapis.com/google.rpc.{}", name));
  any.set_value(detail.SerializeAsString());
}

}  // namespace

std::string SerializedDetails(const absl::Status& status) {
  const ErrorDetail detail = DetailOf(status);
  rpc::Status told;
  told.set_code(static_cast<int>(status.code()));
  told.set_message(MessageOf(status));
  if (detail.reason != v1::ERROR_REASON_UNSPECIFIED) {
    rpc::ErrorInfo info;
    info.set_reason(ReasonName(detail.reason));
    info.set_domain("halflight");
    if (!detail.value.empty()) {
      (*info.mutable_metadata())["value"] = detail.value;
      (*info.mutable_metadata())["allowed"] = detail.allowed;
    }
    AddDetail(told, "ErrorInfo", info);
  }
  if (!detail.field.empty()) {
    rpc::BadRequest bad;
    rpc::BadRequest::FieldViolation& violation = *bad.add_field_violations();
    violation.set_field(detail.field);
    violation.set_description(fmt::format("{}, allowed: {}", detail.value, detail.allowed));
    AddDetail(told, "BadRequest", bad);
  }
  if (detail.retry_after.has_value()) {
    rpc::RetryInfo retry;
    const auto ms = detail.retry_after->count();
    retry.mutable_retry_delay()->set_seconds(ms / 1000);
    retry.mutable_retry_delay()->set_nanos(static_cast<int32_t>(ms % 1000) * 1'000'000);
    AddDetail(told, "RetryInfo", retry);
  }
  return told.details().empty() ? std::string() : told.SerializeAsString();
}

grpc::Status ToGrpc(const absl::Status& status, grpc::CallbackServerContext& context) {
  if (status.ok()) {
    return grpc::Status::OK;
  }
  if (const auto retry_after = DetailOf(status).retry_after) {
    context.AddTrailingMetadata("grpc-retry-pushback-ms", std::to_string(retry_after->count()));
  }
  return {static_cast<grpc::StatusCode>(status.code()), MessageOf(status),
          SerializedDetails(status)};
}

}  // namespace halflight
