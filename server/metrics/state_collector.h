// Reads off the parts of the server how they are doing, when somebody looks. What happens between
// two looks is counted in prometheus_metrics.h.
#pragma once

#include <string>
#include <vector>

#include <prometheus/metric_family.h>

#include "renderer/frame_engine.h"
#include "server/grpc_server.h"
#include "server/handlers/backend.h"

namespace halflight {

// Only references: all of them outlive whoever looks.
struct ServerParts {
  const FrameEngine& engine;
  const Backend& backend;
  const GrpcServer& server;
};

// Any thread.
std::vector<prometheus::MetricFamily> CollectState(const ServerParts& parts);

}  // namespace halflight
