#include "server/stall_guard.h"

#include <mutex>
#include <utility>

namespace halflight {

// What the timer's call may still hold when the guard and what it stands for are gone.
struct StallGuard::Call {
  // Recursive: ending the call may end the guard before `stalled` returns.
  std::recursive_mutex mutex;
  std::function<void()> stalled;
  bool gone = false;
};

StallGuard::StallGuard(Timer& timer, std::chrono::milliseconds limit, std::function<void()> stalled)
    : timer_(timer), limit_(limit), call_(std::make_shared<Call>()) {
  call_->stalled = std::move(stalled);
}

StallGuard::~StallGuard() {
  End();
  const std::lock_guard lock(call_->mutex);
  call_->gone = true;
}

void StallGuard::Begin() {
  if (limit_.count() == 0) {
    return;
  }
  ticket_ = timer_.At(Timer::Clock::now() + limit_, [call = call_] {
    const std::lock_guard lock(call->mutex);
    if (!call->gone) {
      call->stalled();
    }
  });
}

void StallGuard::End() {
  if (ticket_.has_value()) {
    timer_.Cancel(*ticket_);
    ticket_.reset();
  }
}

}  // namespace halflight
