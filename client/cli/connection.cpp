#include "client/cli/connection.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <utility>

#include "client/cli/exit_code.h"
#include "client/security.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

absl::StatusOr<std::string> Token(const ConnectionOptions& options) {
  if (!options.token_file.empty()) {
    return ReadTokenFile(options.token_file);
  }
  const char* const variable = std::getenv("HALFLIGHT_TOKEN");
  return variable == nullptr ? "" : variable;
}

}  // namespace

Connection::Connection(std::optional<LocalServer> server, Client client)
    : server_(std::move(server)), client_(std::move(client)) {}

absl::StatusOr<Connection> Connection::Open(const ConnectionOptions& options,
                                            const std::stop_token& stop) {
  ClientOptions client_options;
  client_options.timeout = std::chrono::ceil<std::chrono::milliseconds>(
      std::chrono::duration<double>(options.timeout_s));  // down to 0 would be for ever
  client_options.stop = stop;
  if (!options.server.empty()) {
    client_options.security = options.security;
    auto token = Token(options);
    if (!token.ok()) {
      return WithExitCode(token.status(), ExitCode::kUsage);
    }
    client_options.security.token = *std::move(token);
    auto client = Client::Connect(options.server, client_options);
    if (!client.ok()) {
      return WithExitCode(
          absl::InvalidArgumentError(fmt::format("--server: {}", MessageOf(client.status()))),
          ExitCode::kUsage);
    }
    return Connection(std::nullopt, *std::move(client));
  }
  LocalServerOptions server_options;
  server_options.device = options.device;
  server_options.stop = stop;
  auto server = LocalServer::Start(server_options);
  if (!server.ok()) {
    return WithExitCode(server.status(), ExitCode::kServerUnavailable);
  }
  auto client = Client::Connect(server->address(), client_options);
  if (!client.ok()) {
    return WithExitCode(client.status(), ExitCode::kServerUnavailable);
  }
  return Connection(*std::move(server), *std::move(client));
}

}  // namespace halflight::client
