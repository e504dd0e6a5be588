// Marks errors that pass by themselves with how long to wait before trying again. Says nothing of
// how the hint travels: see status_to_grpc.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "absl/status/status.h"

namespace halflight {

// ResourceExhausted, passing: the same request may be accepted after the hint.
absl::Status BusyError(const std::string& message);

// Marks an error that somebody else made.
absl::Status WithRetryHint(absl::Status status);

// The hint of an error that has one.
std::optional<std::chrono::milliseconds> RetryHint(const absl::Status& status);

}  // namespace halflight
