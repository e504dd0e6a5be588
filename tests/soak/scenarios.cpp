#include <array>

#include "absl/strings/str_cat.h"
#include "tests/soak/scenario.h"

namespace halflight::soak {

void Require(bool holds, const std::string& what) {
  if (!holds) {
    throw Abandoned(what);
  }
}

void Require(const absl::Status& status, const std::string& what) {
  Require(status.ok(), absl::StrCat(what, ": ", status.ToString()));
}

std::span<const Scenario> Scenarios() {
  static const std::array kScenarios{
      Scenario{"connections",
               "1000 clients, 500 of which do not read their frames",
               "`--max-stall-seconds 0` and `--max-frame-bytes 4GiB`: who does not read keeps its "
               "call and its frame; and the server stopped for 0.3 s",
               {"slow readers ended", "memory more, at most", "health answered within, longest"},
               RunConnections},
      Scenario{
          "cancellations",
          "10,000 calls cancelled at random moments",
          "an engine that keeps memory, a descriptor, a thread and a GL object of each cancelled "
          "frame, and draws other pixels from then on",
          {"descriptors more", "threads more", "GL objects more", "memory more",
           "frames that are other"},
          RunCancellations},
      Scenario{"upload clients killed",
               "Clients killed at random offsets of an upload",
               "`--partial-upload-seconds 1` and clients that come back later: nothing is kept of "
               "what broke off",
               {"parts that the server had", "of these not sent again"},
               RunUploadClientsKilled},
      Scenario{"upload servers killed",
               "The server killed at random moments of uploads, with a cache directory",
               "a disk that loses half of a file, a file half written that is not removed, and in "
               "the end an engine that draws other pixels each time",
               {"sets found that are not", "files left half written", "pictures that are others"},
               RunUploadServersKilled},
      Scenario{"descriptors",
               "No descriptor left in the server, then some again",
               "gRPC's own listener in place of halflightd's",
               {"times that newcomers were not served", "serving again after descriptors"},
               RunDescriptors},
      Scenario{"disk full",
               "A cache directory on a disk that is full",
               "a disk that loses half of a file, and an engine that draws other pixels each time",
               {"files that are not the set", "pictures that are others"},
               RunDiskFull},
      Scenario{"malformed",
               "Malformed, truncated, oversize and out-of-order messages of each RPC",
               "a server that says OK to everything but one method, which it never answers, and "
               "keeps memory of each call",
               {"ended with OK", "not answered within", "memory more"},
               RunMalformed},
      Scenario{"overload",
               "Ten times as many frames asked for as can be drawn",
               "a queue without a bound",
               {"frames under overload of those", "refusals answered within, 99th"},
               RunOverload},
      Scenario{"restarts",
               "SIGTERM under load",
               "`--drain-seconds 0`",
               {"exit codes other than 0", "accepted by the log, and not whole",
                "accepted by the log, with"},
               RunRestarts},
      Scenario{
          "device faults",
          "a device that is reset under load, by one request each time, and one that hangs",
          "an engine that is never reset and draws other pixels each time, resets that are said to "
          "be "
          "nobody's fault, and `--watchdog-seconds 0`",
          {"resets under load", "frames that are other bytes afterwards",
           "times that a request which resets", "health says NOT_SERVING", "and the server ends"},
          RunDeviceFaults},
      Scenario{"stopping",
               "long frames cancelled, half of them by their deadline, and another client's that "
               "waits for "
               "them",
               "an engine that is deaf to it",
               {"half-angle slicing, 20,000 slices: until the renderer is free, longest",
                "light sweep, 8192 x 8192: until the renderer is free, longest",
                "reference: until the renderer is free, longest",
                "scattering, 20,000 slices: until the renderer is free, longest"},
               RunStopping},
      Scenario{"mixed work",
               "Uploads, frames, sequences, cancellations and errors for 15 minutes",
               "an engine that keeps memory of each frame",
               {"memory more, from when", "memory more an hour"},
               RunMixedWork}};
  return kScenarios;
}

}  // namespace halflight::soak
