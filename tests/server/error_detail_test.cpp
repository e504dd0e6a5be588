// What programs read of an error, from where it is made to the bytes on the wire.

#include "server/error_detail.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "halflight/rpc_status.pb.h"
#include "renderer/field_error.h"
#include "server/convert/field_checks.h"
#include "server/status_text.h"
#include "server/status_to_grpc.h"

namespace halflight {
namespace {

using std::chrono::milliseconds;

// The detail of this name in google.rpc.
template <typename Message>
std::optional<Message> Told(const absl::Status& status, const std::string& name) {
  rpc::Status told;
  EXPECT_TRUE(told.ParseFromString(SerializedDetails(status)));
  for (const google::protobuf::Any& any : told.details()) {
    Message message;
    if (any.type_url() == "type.googleapis.com/google.rpc." + name &&
        message.ParseFromString(any.value())) {
      return message;
    }
  }
  return std::nullopt;
}

TEST(ErrorDetail, FieldErrorHasItsPartsBesideItsWords) {
  const absl::Status status = FieldError("scene.shadow.slices", "0", "[1, 64]");
  EXPECT_EQ(status.message(), "scene.shadow.slices: 0, allowed: [1, 64]");
  const ErrorDetail detail = DetailOf(status);
  EXPECT_EQ(detail.reason, v1::ERROR_REASON_INVALID_FIELD);
  EXPECT_EQ(detail.field, "scene.shadow.slices");
  EXPECT_EQ(detail.value, "0");
  EXPECT_EQ(detail.allowed, "[1, 64]");
  EXPECT_FALSE(detail.retry_after.has_value());
}

TEST(ErrorDetail, PathGoesInFrontOfFieldAndMessage) {
  const absl::Status status = Within("scene.inline_particles.", FieldError("payload", "1", "2"));
  EXPECT_EQ(DetailOf(status).field, "scene.inline_particles.payload");
  EXPECT_EQ(status.message(), "scene.inline_particles.payload: 1, allowed: 2");
  EXPECT_EQ(DetailOf(Prefixed("frame 3: ", status)).field, "scene.inline_particles.payload");
}

TEST(ErrorDetail, TellsAServersLimitFromWhatNoServerTakes) {
  const Interval slices{.low = 1.0, .high = 64.0, .server_limit = true};
  for (const auto& [value, reason] : {std::pair(0, v1::ERROR_REASON_INVALID_FIELD),
                                      std::pair(65, v1::ERROR_REASON_LIMIT_EXCEEDED)}) {
    FieldChecks checks;
    checks.InRange("slices", value, slices);
    EXPECT_EQ(DetailOf(checks.status()).reason, reason) << value;
  }
}

TEST(ErrorDetail, WireHasReasonFieldAndRetryAsGoogleRpcWritesThem) {
  const absl::Status busy = BusyError(v1::ERROR_REASON_QUEUE_FULL, "9 frames", "at most 8");
  EXPECT_EQ(busy.message(), "9 frames, allowed: at most 8: retry later");
  const auto info = Told<rpc::ErrorInfo>(busy, "ErrorInfo");
  ASSERT_TRUE(info.has_value());
  EXPECT_EQ(info->reason(), "QUEUE_FULL");
  EXPECT_EQ(info->domain(), "halflight");
  EXPECT_EQ(info->metadata().at("value"), "9 frames");
  EXPECT_EQ(info->metadata().at("allowed"), "at most 8");
  const auto retry = Told<rpc::RetryInfo>(busy, "RetryInfo");
  ASSERT_TRUE(retry.has_value());
  EXPECT_EQ(milliseconds(retry->retry_delay().seconds() * 1000 +
                         retry->retry_delay().nanos() / 1'000'000),
            *DetailOf(busy).retry_after);
  EXPECT_FALSE(Told<rpc::BadRequest>(busy, "BadRequest").has_value());

  const absl::Status limit = LimitError("outputs", "17", "at most 16");
  const auto bad = Told<rpc::BadRequest>(limit, "BadRequest");
  ASSERT_TRUE(bad.has_value());
  ASSERT_EQ(bad->field_violations_size(), 1);
  EXPECT_EQ(bad->field_violations(0).field(), "outputs");
  EXPECT_EQ(bad->field_violations(0).description(), "17, allowed: at most 16");
  EXPECT_EQ(Told<rpc::ErrorInfo>(limit, "ErrorInfo")->reason(), "LIMIT_EXCEEDED");
  EXPECT_EQ(Told<rpc::ErrorInfo>(limit, "ErrorInfo")->metadata().at("allowed"), "at most 16");
  EXPECT_FALSE(Told<rpc::RetryInfo>(limit, "RetryInfo").has_value());
}

TEST(ErrorDetail, ErrorWithNothingToAddHasNoDetails) {
  EXPECT_EQ(SerializedDetails(absl::InternalError("broken")), "");
}

}  // namespace
}  // namespace halflight
