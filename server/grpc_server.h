// The gRPC server round the service: listens, serves health and reflection beside it, drains. Knows
// nothing of what the calls do.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/handlers/backend.h"

namespace halflight {

class GrpcServer {
 public:
  // Listens on every address ("host:port" or "unix:path"), or fails naming the one that it cannot.
  // Block the signals that the process waits for before: the server's threads inherit the mask.
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

  // Health turns to NOT_SERVING and new calls are refused with UNAVAILABLE; calls under way go on.
  void BeginDrain();
  // Whether no call is under way.
  [[nodiscard]] bool idle() const;
  // Calls that ever began.
  [[nodiscard]] uint64_t calls_begun() const;

  // For leaving without the destructor.
  void RemoveSocketFiles() const;

 private:
  struct Parts;
  explicit GrpcServer(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
  std::vector<std::string> addresses_;
};

}  // namespace halflight
