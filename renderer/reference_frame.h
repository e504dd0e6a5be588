// Frames of the reference technique: the image model evaluated on the CPU, in place of all passes.
// Uses no GL; the evaluation itself is in renderer/reference.
#pragma once

#include <stop_token>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/frame.h"

namespace halflight {

// InvalidArgument, naming the field, where the request asks for what the image model has not:
// scattering, light buffers, samples fewer than pixels.
absl::StatusOr<FramePlan> PlanReferenceFrame(const FrameRequest& request);

// Images and light reports of a request that PlanReferenceFrame took; neither plan nor timings.
// Cancelled soon after `stop` was requested. Any thread; uses all cores.
absl::StatusOr<FrameResult> RenderReferenceFrame(const FrameRequest& request,
                                                 const std::stop_token& stop);

}  // namespace halflight
