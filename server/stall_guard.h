// Notices a call whose peer does not take what is sent to it, or does not send what it began, or
// does so too slowly. What becomes of the call is not decided here.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "server/patience.h"
#include "server/timer.h"

namespace halflight {

// One operation at a time: a write, or a read. The timer outlives the guard. `stalled` is called on
// the timer's thread, never once the guard is gone; it may end the guard itself. Limits of 0 at
// once never call it.
class StallGuard {
 public:
  StallGuard(Timer& timer, const PatienceLimits& limits, std::function<void()> stalled);
  ~StallGuard();
  StallGuard(const StallGuard&) = delete;
  StallGuard& operator=(const StallGuard&) = delete;
  StallGuard(StallGuard&&) = delete;
  StallGuard& operator=(StallGuard&&) = delete;

  // Right before the operation is started: it has stalled unless End comes while there is patience.
  void Begin();
  // When it is done, and has brought so many bytes to the peer or from it.
  void End(uint64_t bytes);
  // Between operations: what is waited for next is something new.
  void Restore() { patience_.Restore(); }

 private:
  struct Call;

  void Forget();

  Timer& timer_;
  const bool unlimited_;
  Patience patience_;
  Timer::Clock::time_point begun_;
  const std::shared_ptr<Call> call_;
  std::optional<Timer::Ticket> ticket_;
};

}  // namespace halflight
