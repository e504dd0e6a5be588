#include "server/error_detail.h"

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "renderer/field_error.h"
#include "server/status_text.h"

namespace halflight {
namespace {

constexpr char kReasonPayload[] = "halflight/reason";
constexpr char kRetryPayload[] = "halflight/retry-after-ms";

// About the time of a few frames: long enough for the queue to have moved.
constexpr int kRetryAfterMs = 500;

std::string PayloadOf(const absl::Status& status, const char* name) {
  const absl::optional<absl::Cord> payload = status.GetPayload(name);
  return payload.has_value() ? static_cast<std::string>(*payload) : std::string();
}

absl::Status WithBounds(absl::Status status, const std::string& value, const std::string& allowed) {
  status.SetPayload(kValuePayload, absl::Cord(value));
  status.SetPayload(kAllowedPayload, absl::Cord(allowed));
  return status;
}

}  // namespace

ErrorDetail DetailOf(const absl::Status& status) {
  ErrorDetail detail;
  detail.field = PayloadOf(status, kFieldPayload);
  detail.value = PayloadOf(status, kValuePayload);
  detail.allowed = PayloadOf(status, kAllowedPayload);
  if (!v1::ErrorReason_Parse(PayloadOf(status, kReasonPayload), &detail.reason) &&
      !detail.field.empty()) {
    detail.reason = v1::ERROR_REASON_INVALID_FIELD;
  }
  int milliseconds = 0;
  if (absl::SimpleAtoi(PayloadOf(status, kRetryPayload), &milliseconds)) {
    detail.retry_after = std::chrono::milliseconds(milliseconds);
  }
  return detail;
}

std::string ReasonName(v1::ErrorReason reason) {
  constexpr size_t kPrefix = std::char_traits<char>::length("ERROR_REASON_");
  return v1::ErrorReason_Name(reason).substr(kPrefix);
}

absl::Status WithReason(absl::Status status, v1::ErrorReason reason) {
  status.SetPayload(kReasonPayload, absl::Cord(v1::ErrorReason_Name(reason)));
  return status;
}

absl::Status LimitError(const std::string& field, const std::string& value,
                        const std::string& allowed) {
  return WithReason(FieldError(field, value, allowed), v1::ERROR_REASON_LIMIT_EXCEEDED);
}

absl::Status BusyError(v1::ErrorReason reason, const std::string& value,
                       const std::string& allowed) {
  absl::Status status =
      absl::ResourceExhaustedError(absl::StrCat(value, ", allowed: ", allowed, ": retry later"));
  return WithRetryHint(WithReason(WithBounds(std::move(status), value, allowed), reason));
}

absl::Status TooLongError(const std::string& value, const std::string& allowed) {
  absl::Status status = absl::DeadlineExceededError(absl::StrCat(value, ", allowed: ", allowed));
  return WithReason(WithBounds(std::move(status), value, allowed),
                    v1::ERROR_REASON_FRAME_TIME_EXCEEDED);
}

absl::Status DrainingError() {
  return WithReason(absl::UnavailableError("the server is shutting down: retry elsewhere or later"),
                    v1::ERROR_REASON_DRAINING);
}

absl::Status WithRetryHint(absl::Status status) {
  status.SetPayload(kRetryPayload, absl::Cord(std::to_string(kRetryAfterMs)));
  return status;
}

absl::Status Within(const std::string& path, const absl::Status& status) {
  absl::Status within = Prefixed(path, status);
  if (const std::string field = PayloadOf(status, kFieldPayload); !field.empty()) {
    within.SetPayload(kFieldPayload, absl::Cord(path + field));
  }
  return within;
}

}  // namespace halflight
