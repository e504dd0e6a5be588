// The gRPC server round the service: takes connections, serves health and reflection beside it,
// drains. Knows nothing of what the calls do.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/access/access.h"
#include "server/handlers/backend.h"
#include "server/listen/acceptor.h"
#include "server/listen/listening_socket.h"

namespace halflight {

struct GrpcServerOptions {
  // Whether to serve channelz, which tells everybody who can connect of calls, connections and
  // their peers' addresses. Unset: where there are no strangers, that is, only this machine can
  // connect and nobody has to say who calls. Once in a process, for all servers from then on.
  std::optional<bool> channelz;
};

class GrpcServer {
 public:
  // Serves who connects to these sockets, or fails naming the one that cannot listen. Health and
  // reflection answer everybody: they tell what load balancers and tools need before anybody could
  // authenticate, and nothing that is not in the published protos. Block the signals that the
  // process waits for before: the server's threads inherit the mask.
  static absl::StatusOr<std::unique_ptr<GrpcServer>> Start(std::vector<ListeningSocket> sockets,
                                                           const Access& access,
                                                           const Backend& backend,
                                                           const GrpcServerOptions& options = {});
  // The same with new sockets ("host:port" or "unix:path"), for everybody who can reach them.
  static absl::StatusOr<std::unique_ptr<GrpcServer>> Start(
      const std::vector<std::string>& addresses, const Backend& backend);

  // Cancels the calls still under way, waits for them to end, and removes socket files.
  ~GrpcServer();
  GrpcServer(const GrpcServer&) = delete;
  GrpcServer& operator=(const GrpcServer&) = delete;
  GrpcServer(GrpcServer&&) = delete;
  GrpcServer& operator=(GrpcServer&&) = delete;

  // The addresses with the ports that were taken for 0.
  [[nodiscard]] const std::vector<std::string>& addresses() const { return addresses_; }

  // What health says, of the server as a whole ("") and of halflight.v1.RenderService. Any thread.
  [[nodiscard]] bool serving() const;

  // Health turns to NOT_SERVING, then nobody can connect any more and new calls are refused with
  // UNAVAILABLE; calls under way go on. Socket files are removed.
  void BeginDrain();
  // Whether no call is under way but those that are refused.
  [[nodiscard]] bool idle() const;
  // All that are under way of one RPC.
  [[nodiscard]] int calls(Rpc rpc) const;
  [[nodiscard]] ConnectionCounts connections() const;
  // Calls that ever began.
  [[nodiscard]] uint64_t calls_begun() const;

 private:
  struct Parts;
  explicit GrpcServer(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
  std::vector<std::string> addresses_;
};

}  // namespace halflight
