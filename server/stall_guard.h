// Ends a call whose peer does not take what is sent to it, or does not send what it began.
#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "server/call_token.h"
#include "server/timer.h"

namespace halflight {

// One operation at a time: a write, or a read. The call outlives the guard, the timer both. A
// limit of 0 never ends anything.
class StallGuard {
 public:
  StallGuard(Timer& timer, std::chrono::seconds limit, CallToken& call);
  ~StallGuard();
  StallGuard(const StallGuard&) = delete;
  StallGuard& operator=(const StallGuard&) = delete;
  StallGuard(StallGuard&&) = delete;
  StallGuard& operator=(StallGuard&&) = delete;

  // Right before the operation is started: the call is ended unless End comes within the limit.
  void Begin();
  // When it is done.
  void End();

 private:
  struct Call;

  Timer& timer_;
  const std::chrono::seconds limit_;
  const std::shared_ptr<Call> call_;
  std::optional<Timer::Ticket> ticket_;
};

}  // namespace halflight
