// Everything that a traversal of the particles is given.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"
#include "renderer/frame_plan.h"
#include "renderer/gpu.h"
#include "renderer/particle_view.h"
#include "renderer/passes/composite.h"
#include "renderer/passes/project.h"
#include "renderer/raster_pieces.h"
#include "renderer/readback.h"
#include "renderer/stage_clock.h"

namespace halflight {

struct TraversalContext {
  Gpu& gpu;
  const DeviceInfo& device;
  FrameCache& cache;
  RasterPieces& pieces;
  const Scene& scene;
  const Traversal& traversal;
  const ParticleView& particles;
  const ParticleBuffers& buffers;
  const TargetProjection& eye;
  std::span<const CompositeTarget> targets;  // one for each band of the image
  std::vector<PlannedPass>& reused;          // as in DrawnFrame
  Readback& readback;
  StageClock& clock;
  std::stop_token stop;
};

}  // namespace halflight
