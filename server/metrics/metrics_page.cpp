#include "server/metrics/metrics_page.h"

#include <iterator>
#include <string>
#include <utility>

#include <prometheus/text_serializer.h>

#include "server/log/log.h"
#include "server/metrics/process_state.h"

namespace halflight {
namespace {

void Append(std::vector<prometheus::MetricFamily>& to,
            std::vector<prometheus::MetricFamily> families) {
  std::move(families.begin(), families.end(), std::back_inserter(to));
}

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsServer>> ShowMetrics(std::vector<ListeningSocket> sockets,
                                                           const PrometheusMetrics& counted,
                                                           const ServerParts& parts) {
  if (sockets.empty()) {
    return nullptr;
  }
  const std::string address = sockets.front().address();
  auto server = MetricsServer::Start(std::move(sockets), [&counted, parts] {
    std::vector<prometheus::MetricFamily> families = counted.Collect();
    Append(families, CollectState(parts));
    Append(families, ProcessState());
    return prometheus::TextSerializer().Serialize(families);
  });
  if (server.ok()) {
    Log(LogLevel::kInfo, "metrics", {{"address", address}});
  }
  return server;
}

}  // namespace halflight
