#include "server/retry_hint.h"

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"

namespace halflight {
namespace {

constexpr const char* kPayloadName = "halflight/retry-after-ms";

// About the time of a few frames: long enough for the queue to have moved.
constexpr int kRetryAfterMs = 500;

}  // namespace

absl::Status BusyError(const std::string& message) {
  return WithRetryHint(absl::ResourceExhaustedError(message));
}

absl::Status WithRetryHint(absl::Status status) {
  status.SetPayload(kPayloadName, absl::Cord(std::to_string(kRetryAfterMs)));
  return status;
}

std::optional<std::chrono::milliseconds> RetryHint(const absl::Status& status) {
  const absl::optional<absl::Cord> payload = status.GetPayload(kPayloadName);
  int milliseconds = 0;
  if (!payload.has_value() ||
      !absl::SimpleAtoi(static_cast<std::string>(*payload), &milliseconds)) {
    return std::nullopt;
  }
  return std::chrono::milliseconds(milliseconds);
}

}  // namespace halflight
