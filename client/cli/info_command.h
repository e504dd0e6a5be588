// halflight info: what a server is and can do.
#pragma once

#include <stop_token>

#include "absl/status/status.h"
#include "client/cli/options.h"

namespace halflight::client {

absl::Status RunInfo(const InfoOptions& options, const std::stop_token& stop);

}  // namespace halflight::client
