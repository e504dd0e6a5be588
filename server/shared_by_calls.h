// What all calls of a service share, and what becomes of those whose peers keep them waiting.
#pragma once

#include <chrono>
#include <functional>

#include "server/call_token.h"
#include "server/handlers/backend.h"
#include "server/listen/connections.h"
#include "server/open_sequences.h"
#include "server/patience.h"
#include "server/timer.h"

namespace halflight {

struct SharedByCalls {
  SharedByCalls(const Backend& the_backend, const Access& the_access, Connections& the_connections)
      : backend(the_backend), access(the_access), connections(the_connections) {}

  [[nodiscard]] PatienceLimits patience() const {
    return {.at_once = std::chrono::seconds(backend.limits.max_stall_seconds),
            .bytes_per_second = backend.limits.min_bytes_per_second};
  }
  // For a StallGuard: what ends the token's call. It is cancelled, and where that does nothing its
  // connection is cut off, once that too has stalled for as long.
  std::function<void()> StallEnder(CallToken& token);

  const Backend backend;
  const Access& access;
  Connections& connections;
  CallCount count;
  bool looking_at_connections = false;  // on the timer's thread
  Timer timer;                          // after what its thread uses
  OpenSequences sequences;

 private:
  void LookAtConnections();
};

}  // namespace halflight
