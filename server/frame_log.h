// What the log says of a frame, one place for all of it. Keeps no history and writes nothing.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "server/caller.h"
#include "server/convert/convert_frame.h"
#include "server/log/log_event.h"
#include "server/made_frame.h"

namespace halflight {

// A stage's name as a key: those of the renderer are for people, and have spaces.
std::string StageKey(std::string stage);

// As text: request_id=a tenant=b peer=ipv4:127.0.0.1:40000 technique=SHADOW_TECHNIQUE_HALF_ANGLE
// particles=65536 size=640x480 outputs=2 render_ms=12.3 ... outcome=OK; call_id where the call has
// another name. A measured error adds relative_rmse=0.031, a target attempts=2 target_met=true, a
// failure reason and message. Of a frame that failed only the timings are looked at.
LogFields FrameFields(const FrameJob& job, const MadeFrame& frame, const absl::Status& outcome);

// A request that never became a frame.
LogFields RefusedFrameFields(const std::string& request_id, const Caller& caller,
                             const absl::Status& outcome);

}  // namespace halflight
