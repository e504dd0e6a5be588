// halflightd as a process that is watched from outside: what it holds, and whether it is well.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <grpcpp/channel.h>

#include "tests/process/process.h"

namespace halflight::soak {

class Server : public testing::Process {
 public:
  // On a free port, with further flags and the environment of deploy/halflightd.service. Waits
  // until it listens.
  Server(const testing::Folder& folder, std::vector<std::string> flags,
         const std::string& program = "halflightd");

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] bool Serves() const;  // health, over a new connection
  // Memory of its own, none of it shared with others, in MiB.
  [[nodiscard]] double Megabytes() const;
  // A value of its metrics page; none where the server does not tell.
  [[nodiscard]] std::optional<double> Metric(const std::string& name) const;
  // Waits for what it does when no call comes for a while: memory goes back to the system.
  void Rest() const;
  // Sets a limit of the process that runs, and gives what it was.
  uint64_t SetLimit(int resource, uint64_t value) const;

 private:
  std::string address_;
  std::string metrics_address_;  // empty: it has none
};

// What GL renders with, as the server says.
std::string GlRenderer();

// The largest Megabytes of a server while this lives.
class PeakMemory {
 public:
  explicit PeakMemory(const Server& server);
  [[nodiscard]] double Stop();

 private:
  std::atomic<double> peak_ = 0.0;
  std::jthread thread_;
};

// Asks for health, over one connection of its own, until it is stopped.
class HealthProbe {
 public:
  explicit HealthProbe(const std::string& address);
  // Milliseconds of each answer; a million where it was another than SERVING.
  std::vector<double> Stop();

 private:
  std::shared_ptr<grpc::Channel> channel_;
  std::vector<double> waits_;  // the thread's until it is joined
  std::jthread thread_;
};

}  // namespace halflight::soak
