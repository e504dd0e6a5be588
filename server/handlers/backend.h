// What the handlers of all calls share. Only references: main owns the parts.
#pragma once

#include <string>

#include "renderer/frame_engine.h"
#include "server/frame_pipeline.h"
#include "server/limits.h"
#include "server/metrics/metrics.h"
#include "server/partial_uploads.h"
#include "server/particle_store.h"

namespace halflight {

struct Backend {
  const DeviceInfo& device;
  const ServerLimits& limits;
  const std::string& server_version;
  ParticleStore& store;
  PartialUploads& partial_uploads;
  FramePipeline& pipeline;
  Metrics& metrics = Metrics::None();
};

}  // namespace halflight
