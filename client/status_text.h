// The words of an absl::Status. Does not decide what is an error.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace halflight::client {

inline std::string MessageOf(const absl::Status& status) {
  return {status.message().data(), status.message().size()};
}

}  // namespace halflight::client
