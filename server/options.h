// The command line of halflightd: what can be set, and whether it makes sense together.
#pragma once

#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/device_fault.h"
#include "server/access/access.h"
#include "server/limits.h"
#include "server/log/log.h"
#include "server/metrics/metrics_server.h"

namespace halflight {

inline constexpr const char* kDefaultAddress = "127.0.0.1:50551";

struct Options {
  // host:port or unix:path. None: kDefaultAddress, or only the sockets that a service manager hands
  // over.
  std::vector<std::string> addresses;
  AccessOptions access;
  std::string device = "auto";  // as in RenderThreadOptions
  ServerLimits limits;
  std::string log_level = "info";
  LogFormat log_format = LogFormat::kText;
  MetricsOptions metrics;
  std::optional<bool> channelz;  // as in GrpcServerOptions
  int encode_threads = 0;        // filled in: one for each core, less the one that renders
  int drain_seconds = 30;
  int watchdog_seconds = 60;              // 0: a device that hangs is not noticed
  std::shared_ptr<PlannedFaults> faults;  // null: none
  std::string cache_dir;                  // empty: particle sets are kept in memory only
  uint64_t max_reuse_bytes = 1 * kGiB;    // as in FrameRendererOptions
  int frames_in_flight = 0;               // as in FrameRendererOptions
};

// What a flag does not say is taken from the file that --config names: a line "<flag> = <value>"
// each. None when only --help or --version was asked for, and printed. InvalidArgument "<flag>:
// <value>, allowed: <allowed>", and of a line of the file that is wrong "<file>: <what>".
absl::StatusOr<std::optional<Options>> ParseOptions(int argc, const char* const* argv,
                                                    std::ostream& out);

}  // namespace halflight
