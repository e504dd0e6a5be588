// Frames of the light sweep, on the CPU: particles in their exact order along each light, shadows
// fitted over every footprint, the image composited front to back tile by tile. Uses no GL.
#pragma once

#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame.h"
#include "renderer/frame_images.h"
#include "renderer/particle_view.h"
#include "renderer/stage_clock.h"

namespace halflight {

// Adds the sweep's passes to a plan whose sizes are set. InvalidArgument, naming the field, where
// the request asks for what the sweep has not: scattering, light layers, a shadow-casting light
// among the particles.
absl::Status PlanSweepFrame(const FrameRequest& request, const ParticleView& particles,
                            FramePlan& plan);

// What a request that PlanSweepFrame took shows; fills in the reports, one for each light.
// Cancelled soon after `stop` was requested. Uses all cores.
absl::StatusOr<DrawnImages> DrawSweepFrame(const FrameRequest& request,
                                           const ParticleView& particles, const FramePlan& plan,
                                           StageClock& clock, const std::stop_token& stop,
                                           std::vector<LightReport>& reports);

}  // namespace halflight
