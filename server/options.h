// The command line of halflightd: what can be set, and whether it makes sense together.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/limits.h"

namespace halflight {

struct Options {
  std::vector<std::string> addresses{"127.0.0.1:50551"};  // host:port or unix:path
  std::string device = "auto";                            // as in RenderThreadOptions
  ServerLimits limits;
  std::string log_level = "info";
  int encode_threads = 0;  // filled in: one for each core, less the one that renders
  int drain_seconds = 30;
  std::string cache_dir;                // empty: particle sets are kept in memory only
  uint64_t max_reuse_bytes = 1 * kGiB;  // as in FrameRendererOptions
  int frames_in_flight = 0;             // as in FrameRendererOptions
};

// None when only --help or --version was asked for, and printed. InvalidArgument "<flag>: <value>,
// allowed: <allowed>".
absl::StatusOr<std::optional<Options>> ParseOptions(int argc, const char* const* argv,
                                                    std::ostream& out);

}  // namespace halflight
