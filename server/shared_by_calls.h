// What all calls of a service share, and what becomes of those whose peers keep them waiting.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>

#include "server/call_token.h"
#include "server/handlers/backend.h"
#include "server/listen/connections.h"
#include "server/open_sequences.h"
#include "server/timer.h"

namespace halflight {

class SharedByCalls {
 public:
  SharedByCalls(const Backend& the_backend, const Access& the_access, Connections& connections)
      : backend(the_backend), access(the_access), connections_(connections) {}

  [[nodiscard]] std::chrono::milliseconds stall_limit() const {
    return std::chrono::seconds(backend.limits.max_stall_seconds);
  }
  // For a StallGuard: what ends the token's call. It is cancelled, and where that does nothing its
  // connection is cut off, once that too has stalled for the limit.
  std::function<void()> StallEnder(CallToken& token);

  const Backend backend;
  const Access& access;
  CallCount count;
  Timer timer;
  OpenSequences sequences;

 private:
  void LookAtConnections();

  Connections& connections_;
  std::atomic<bool> looking_ = false;
};

}  // namespace halflight
