// A halflightd of one's own, on a private unix socket, for as long as this object lives.
// Leaves out talking to it: connect a Client to address().
#pragma once

#include <chrono>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"

namespace halflight::client {

struct LocalServerOptions {
  std::string executable;  // empty: halflightd beside the running program, or else in PATH
  std::string device;      // halflightd --device; empty: its own choice
  std::string log_level = "warn";
  std::chrono::milliseconds start_timeout{30000};
  std::stop_token stop;  // ends the wait for the server with CANCELLED
};

class LocalServer {
 public:
  // Starts the server and waits until it answers. Call from a thread that lives as long as the
  // server, such as main's: the kernel ends the server with the thread that started it, so that
  // none is left behind by a program that was killed. NotFound where there is no executable;
  // Unavailable, with the last lines of the server's log, where it ends or does not answer in time.
  static absl::StatusOr<LocalServer> Start(const LocalServerOptions& options = {});
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;
  LocalServer(LocalServer&&) noexcept;
  LocalServer& operator=(LocalServer&&) noexcept;
  // Lets the server finish what it runs, for 5 s at most, and removes its socket.
  ~LocalServer();

  // For Client::Connect.
  [[nodiscard]] const std::string& address() const;
  // The last 4 KiB of what the server logged.
  [[nodiscard]] std::string LogTail() const;

 private:
  class Process;
  explicit LocalServer(std::unique_ptr<Process> process);
  std::unique_ptr<Process> process_;
};

}  // namespace halflight::client
