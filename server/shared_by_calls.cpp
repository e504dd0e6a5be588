#include "server/shared_by_calls.h"

#include <algorithm>

namespace halflight {

std::function<void()> SharedByCalls::StallEnder(CallToken& token) {
  return [this, &token] {
    token.EndForStall(std::chrono::seconds(backend.limits.max_stall_seconds));
    if (!looking_at_connections) {
      looking_at_connections = true;
      LookAtConnections();
    }
  };
}

// On the timer's thread, where all calls stall: again and again, until none is left that did.
void SharedByCalls::LookAtConnections() {
  using std::chrono::milliseconds;
  if (count.stalled == 0) {
    looking_at_connections = false;
    return;
  }
  const milliseconds limit = std::chrono::seconds(backend.limits.max_stall_seconds);
  const auto apart = std::clamp(limit / 20, milliseconds(1), milliseconds(1000));
  connections.CutOffStalled(patience(), apart);
  timer.At(Timer::Clock::now() + apart, [this] { LookAtConnections(); });
}

}  // namespace halflight
