// Frames of the light sweep and of the particle shadow map on the CPU: all cores, no GL.
#pragma once

#include <vector>

#include "renderer/frame_plan.h"
#include "renderer/shadow_technique.h"

namespace halflight::sweep {

// Adds to the plan: a traversal for each light that casts shadows, and the passes of it and of the
// eye. `technique` is the service's name of the one that plans; InvalidArgument, naming the field,
// for a shadow-casting light among the particles.
absl::Status PlanFrame(const FrameRequest& request, const ParticleView& particles,
                       const char* technique, FramePlan& plan);

// Draws what PlanFrame planned. Cancelled when the context's stop says so.
absl::StatusOr<DrawnFrame> DrawOnCpu(const DrawContext& context);

// InvalidArgument, naming the field, where lights are too many or the image too large.
absl::Status CheckSizes(const FrameRequest& request, const char* technique);

}  // namespace halflight::sweep
