// Everything that a traversal of the particles is given.
#pragma once

#include <stop_token>

#include "absl/status/statusor.h"
#include "renderer/frame_plan.h"
#include "renderer/gpu.h"
#include "renderer/particle_view.h"
#include "renderer/passes/composite.h"
#include "renderer/passes/project.h"
#include "renderer/stage_clock.h"

namespace halflight {

struct TraversalContext {
  Gpu& gpu;
  const Scene& scene;
  const Traversal& traversal;
  const ParticleView& particles;
  const ParticleBuffers& buffers;
  const TargetProjection& eye;
  const CompositeTarget& target;
  StageClock& clock;
  std::stop_token stop;
};

}  // namespace halflight
