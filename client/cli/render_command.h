// halflight render: particle files in, images out.
#pragma once

#include <stop_token>

#include "absl/status/status.h"
#include "client/cli/options.h"

namespace halflight::client {

// The status is marked with its exit code where the server did not say it.
absl::Status RunRender(const RenderOptions& options, const std::stop_token& stop);

}  // namespace halflight::client
