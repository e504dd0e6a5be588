// All metrics of the server on one page: what was counted, and how it is doing at the moment.
#pragma once

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "server/listen/listening_socket.h"
#include "server/metrics/metrics_server.h"
#include "server/metrics/prometheus_metrics.h"
#include "server/metrics/state_collector.h"

namespace halflight {

// Shows the page to who connects to these sockets, until what is returned goes, which has to be
// before `counted` and the parts. Null where there are no sockets.
absl::StatusOr<std::unique_ptr<MetricsServer>> ShowMetrics(std::vector<ListeningSocket> sockets,
                                                           const PrometheusMetrics& counted,
                                                           const ServerParts& parts);

}  // namespace halflight
