// Writes files whole or not at all. Knows nothing of what is in them.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace halflight::client {

// Creates the directory that `path` lies in and asks whether it may be written to, so that a frame
// is not rendered in vain.
absl::Status PrepareDirectoryOf(const std::string& path);

// Writes a temporary file beside `path` and renames it, so that nobody sees half a file; what is no
// regular file (such as /dev/null) is written to directly. The error names file and reason.
absl::Status WriteFileWhole(const std::string& path, std::string_view bytes);

}  // namespace halflight::client
