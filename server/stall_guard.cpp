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

StallGuard::StallGuard(Timer& timer, const PatienceLimits& limits, std::function<void()> stalled)
    : timer_(timer),
      unlimited_(limits.at_once.count() == 0),
      patience_(limits),
      call_(std::make_shared<Call>()) {
  call_->stalled = std::move(stalled);
}

StallGuard::~StallGuard() {
  Forget();
  const std::lock_guard lock(call_->mutex);
  call_->gone = true;
}

void StallGuard::Begin() {
  if (unlimited_) {
    return;
  }
  begun_ = Timer::Clock::now();
  ticket_ = timer_.At(begun_ + patience_.left(), [call = call_] {
    const std::lock_guard lock(call->mutex);
    if (!call->gone) {
      call->stalled();
    }
  });
}

void StallGuard::End(uint64_t bytes) {
  patience_.Spend(Timer::Clock::now() - begun_, bytes);
  Forget();
}

void StallGuard::Forget() {
  if (ticket_.has_value()) {
    timer_.Cancel(*ticket_);
    ticket_.reset();
  }
}

}  // namespace halflight
