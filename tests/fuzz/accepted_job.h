// What a request that was accepted is held to: nothing behind conversion checks values again.
#pragma once

#include "absl/status/status.h"
#include "server/convert/convert_frame.h"
#include "server/limits.h"

namespace halflight::fuzz {

// All numbers finite and within the limits, references within what they refer to, and the plan and
// the projections of the frame can be made of it, without GL.
void CheckAccepted(const FrameJob& job, const ServerLimits& limits);

// A refusal says what a client needs: a code that fits, the field to blame, and what is allowed.
void CheckRefused(const absl::Status& status);

}  // namespace halflight::fuzz
