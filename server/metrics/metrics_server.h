// Shows the metrics over plain HTTP to whoever can connect: GET /metrics in Prometheus's text
// format, nothing else. Counts nothing.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/listen/listening_socket.h"

namespace halflight {

struct MetricsOptions {
  std::string address{};  // host:port or unix:path; empty: metrics are neither counted nor shown
  // Whether that may be where others than this machine can connect: they see everything, unasked
  // who they are, and so does everybody on the way.
  bool insecure = false;
};

// The sockets of the address; none where there is none. InvalidArgument where others than this
// machine could connect and that is not allowed, which otherwise is logged; Unavailable where it
// cannot be taken. Both name --metrics-address.
absl::StatusOr<std::vector<ListeningSocket>> BindMetricsAddress(const MetricsOptions& options);

// prometheus-cpp's own server is not used: its accept (civetweb 1.15) takes a whole core for as
// long as no descriptors are left, just when the cores are needed. This one accepts as the service
// does.
class MetricsServer {
 public:
  // Makes the page, on one of the server's threads; by several at once.
  using Page = std::function<std::string()>;

  // Of a whole request; as long as scrapers wait by default.
  static constexpr std::chrono::seconds kPatience{10};

  // Unavailable where a socket cannot listen.
  static absl::StatusOr<std::unique_ptr<MetricsServer>> Start(
      std::vector<ListeningSocket> sockets, Page page, std::chrono::seconds patience = kPatience);
  // Hangs up on whoever is connected. `page` is not called any more when it returns.
  virtual ~MetricsServer() = default;
};

}  // namespace halflight
