// Errors of one field of a request: in words for people, and with their parts beside for programs.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace halflight {

// InvalidArgument "<field>: <value>, allowed<under>: <allowed>", where `under` is empty or such as
// " under technique LIGHT_SWEEP". Has field, value and allowed as payloads of the names below.
absl::Status FieldError(const std::string& field, const std::string& value,
                        const std::string& allowed, const std::string& under = "");

inline constexpr char kFieldPayload[] = "halflight/field";
inline constexpr char kValuePayload[] = "halflight/value";
inline constexpr char kAllowedPayload[] = "halflight/allowed";

}  // namespace halflight
