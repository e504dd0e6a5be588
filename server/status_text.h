// The words of an absl::Status, and a way to add to them. Does not decide what is an error.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace halflight {

std::string MessageOf(const absl::Status& status);

// The same error, hints and all, with its message after `prefix`.
absl::Status Prefixed(const std::string& prefix, const absl::Status& status);

// The same error, hints and all, under another code.
absl::Status WithCode(absl::StatusCode code, const absl::Status& status);

}  // namespace halflight
