// The gRPC service: one forwarding method an RPC, and nothing else that gRPC has to be known for.
// What the calls do stands in handlers/.
#pragma once

#include <cstdint>
#include <memory>

#include "server/access/access.h"
#include "server/handlers/backend.h"
#include "server/listen/connections.h"

namespace grpc {
class Service;
}  // namespace grpc

namespace halflight {

class RenderService {
 public:
  // All outlive the service. Calls of whom `access` does not know end with UNAUTHENTICATED.
  // `connections`: those that calls come by, ended where calls stall and cannot be ended otherwise.
  RenderService(const Backend& backend, const Access& access, Connections& connections);
  // After the gRPC server that it was registered with.
  ~RenderService();
  RenderService(const RenderService&) = delete;
  RenderService& operator=(const RenderService&) = delete;
  RenderService(RenderService&&) = delete;
  RenderService& operator=(RenderService&&) = delete;

  // What a gRPC server registers.
  grpc::Service& grpc_service();

  // From now on new calls are refused with UNAVAILABLE, and no more is read of sequences; frames
  // under way go on.
  void BeginDrain();
  // Calls under way: those that are not refused, and all of one RPC.
  [[nodiscard]] int served_calls() const;
  [[nodiscard]] int active_calls(Rpc rpc) const;
  // All that ever began.
  [[nodiscard]] uint64_t calls_begun() const;

 private:
  class Calls;
  std::unique_ptr<Calls> calls_;
};

}  // namespace halflight
