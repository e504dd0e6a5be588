#include "renderer/field_error.h"

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"

namespace halflight {

absl::Status FieldError(const std::string& field, const std::string& value,
                        const std::string& allowed, const std::string& under) {
  absl::Status error = absl::InvalidArgumentError(
      absl::StrCat(field, ": ", value, ", allowed", under, ": ", allowed));
  error.SetPayload(kFieldPayload, absl::Cord(field));
  error.SetPayload(kValuePayload, absl::Cord(value));
  error.SetPayload(kAllowedPayload, absl::Cord(allowed));
  return error;
}

}  // namespace halflight
