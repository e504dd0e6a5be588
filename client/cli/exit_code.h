// How the command ends: the exit codes that scripts may rely on, carried by the statuses that
// lead to them. Leaves out printing (main.cpp).
#pragma once

#include "absl/status/status.h"

namespace halflight::client {

enum class ExitCode : int {
  kOk = 0,
  kFailed = 1,             // a fault of the server, or data that arrived damaged
  kUsage = 2,              // flags or scene file
  kInput = 3,              // a particle file is missing or malformed
  kRefused = 4,            // the server refused the request
  kServerUnavailable = 5,  // no server was started or reached, had room, or answered in time
  kOutput = 6,             // a file could not be written
  kTargetMissed = 7,       // --max-error or --max-time was not met; the best frame is written
  kInterrupted = 130,      // SIGINT or SIGTERM
};

// The same list for --help.
inline constexpr const char* kExitCodesHelp =
    "Exit codes: 0 done; 1 fault of the server, or damaged data; 2 wrong flags or scene file;\n"
    "3 particle file missing or malformed; 4 the server refused the request; 5 no server, none\n"
    "with room, or no answer in time; 6 a file could not be written; 7 --max-error or --max-time\n"
    "not met, the best frame tried is written; 130 interrupted.";

// The same status, to end with `code`. Cancellation stays what it is.
absl::Status WithExitCode(absl::Status status, ExitCode code);

// What the status was marked with; otherwise what its code means when it comes from a server.
ExitCode ExitCodeOf(const absl::Status& status);

}  // namespace halflight::client
