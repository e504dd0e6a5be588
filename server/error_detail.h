// What an error carries beside its words: a reason, the field that is to blame, and how long to
// wait before trying again. Says nothing of how that travels: see status_to_grpc.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "halflight/v1/error.pb.h"

namespace halflight {

struct ErrorDetail {
  v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED;
  std::string field;  // its path; empty: no field is to blame
  std::string value;  // received
  std::string allowed;
  std::optional<std::chrono::milliseconds> retry_after;  // none: trying again does not help
};

// Of any error. Errors that name a field and no reason are of an invalid one.
ErrorDetail DetailOf(const absl::Status& status);

// As programs know it: without its prefix, such as "QUEUE_FULL".
std::string ReasonName(v1::ErrorReason reason);

absl::Status WithReason(absl::Status status, v1::ErrorReason reason);

// FieldError of a value that is beyond one of ServerLimits.
absl::Status LimitError(const std::string& field, const std::string& value,
                        const std::string& allowed);

// DeadlineExceeded: `value` is what it came to, `allowed` the limit, both in words.
absl::Status TooLongError(const std::string& value, const std::string& allowed);

// ResourceExhausted, passing: the same request may be accepted after some time. `value`: what was
// asked for or is there, `allowed`: the limit, both in words.
absl::Status BusyError(v1::ErrorReason reason, const std::string& value,
                       const std::string& allowed);

// Unavailable: the server is shutting down.
absl::Status DrainingError();

// Marks an error that somebody else made as passing.
absl::Status WithRetryHint(absl::Status status);

// The same error of a field within `path`, such as "scene.shadow.": the field's path and the
// message have it in front.
absl::Status Within(const std::string& path, const absl::Status& status);

}  // namespace halflight
