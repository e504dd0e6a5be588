// What the handlers of all calls share. Only references: main owns the parts.
#pragma once

#include <string>

#include "renderer/frame_engine.h"
#include "server/byte_budget.h"
#include "server/frame_pipeline.h"
#include "server/limits.h"
#include "server/particle_store.h"

namespace halflight {

struct Backend {
  const DeviceInfo& device;
  const ServerLimits& limits;
  const std::string& server_version;
  ParticleStore& store;
  ByteBudget& upload_memory;
  FramePipeline& pipeline;
};

}  // namespace halflight
