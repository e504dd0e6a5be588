// Notices a call whose peer does not take what is sent to it, or does not send what it began. What
// becomes of the call is not decided here.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "server/timer.h"

namespace halflight {

// One operation at a time: a write, or a read. The timer outlives the guard. `stalled` is called on
// the timer's thread, never once the guard is gone; it may end the guard itself. A limit of 0 never
// calls it.
class StallGuard {
 public:
  StallGuard(Timer& timer, std::chrono::milliseconds limit, std::function<void()> stalled);
  ~StallGuard();
  StallGuard(const StallGuard&) = delete;
  StallGuard& operator=(const StallGuard&) = delete;
  StallGuard(StallGuard&&) = delete;
  StallGuard& operator=(StallGuard&&) = delete;

  // Right before the operation is started: it has stalled unless End comes within the limit.
  void Begin();
  // When it is done.
  void End();

 private:
  struct Call;

  Timer& timer_;
  const std::chrono::milliseconds limit_;
  const std::shared_ptr<Call> call_;
  std::optional<Timer::Ticket> ticket_;
};

}  // namespace halflight
