// One structured log line a frame: key=value pairs, one place for all of them. Keeps no history.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "server/caller.h"
#include "server/convert/convert_frame.h"
#include "server/made_frame.h"

namespace halflight {

// As it is written: request_id="a" tenant="b" peer="ipv4:127.0.0.1:40000" technique=HALF_ANGLE
// particles=65536 size=640x480 outputs=2 render_ms=12.3 ... outcome=OK. A measured error adds
// relative_rmse=0.031, a target attempts=2 target_met=true, a failure message="...". Of a frame
// that failed only the timings are looked at.
std::string FrameLogLine(const FrameJob& job, const MadeFrame& frame, const absl::Status& outcome);

// A request that never became a frame.
std::string RefusalLogLine(const std::string& request_id, const Caller& caller,
                           const absl::Status& outcome);

}  // namespace halflight
