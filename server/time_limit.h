// How long something may be worked on: what it spends waiting for others does not count. Only
// watches.
#pragma once

#include <chrono>
#include <functional>
#include <optional>

#include "server/timer.h"

namespace halflight {

// One thread at a time.
class TimeLimit {
 public:
  using Clock = Timer::Clock;

  // Calls `exceeded` on the timer's thread once it has run for so long altogether; never for
  // milliseconds::max(). The timer outlives the last call of Pause.
  TimeLimit(Timer& timer, std::chrono::milliseconds allowed, std::function<void()> exceeded);

  // Nothing where it runs already.
  void Run();
  // Nothing where it does not run. A call that has begun goes on.
  void Pause();

 private:
  Timer& timer_;
  std::optional<Clock::duration> left_;  // none: for ever
  const std::function<void()> exceeded_;
  Clock::time_point since_;
  std::optional<Timer::Ticket> ticket_;  // while it runs
};

}  // namespace halflight
