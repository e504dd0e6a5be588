// The server that a command talks to: the one named, or one started for as long as this lives.
// Leaves out what is said to it (client.h).
#pragma once

#include <optional>
#include <stop_token>

#include "absl/status/statusor.h"
#include "client/cli/options.h"
#include "client/client.h"
#include "client/local_server.h"

namespace halflight::client {

class Connection {
 public:
  // Errors are marked with their exit code.
  static absl::StatusOr<Connection> Open(const ConnectionOptions& options,
                                         const std::stop_token& stop);

  Client& client() { return client_; }

 private:
  Connection(std::optional<LocalServer> server, Client client);

  // Before the client, which goes first at the end.
  std::optional<LocalServer> server_;
  Client client_;
};

}  // namespace halflight::client
