// File names with a frame number in them: 'plume.%04d.ply'.
// Leaves out which frames there are (flag_values.h).
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace halflight::client {

// InvalidArgument unless the pattern has exactly one %d or %0Nd; %% stands for a percent sign.
absl::Status CheckPattern(const std::string& pattern);

// The name of one frame. Valid after CheckPattern said OK.
std::string ExpandPattern(const std::string& pattern, int64_t frame);

}  // namespace halflight::client
