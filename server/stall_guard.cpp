#include "server/stall_guard.h"

#include <mutex>

namespace halflight {

// What the timer's call may still hold when the guard and its call are gone.
struct StallGuard::Call {
  // Recursive: gRPC may end the call, and with it the guard, before EndForStall returns.
  std::recursive_mutex mutex;
  CallToken* token;  // null: gone
};

StallGuard::StallGuard(Timer& timer, std::chrono::seconds limit, CallToken& call)
    : timer_(timer), limit_(limit), call_(std::make_shared<Call>()) {
  call_->token = &call;
}

StallGuard::~StallGuard() {
  End();
  const std::lock_guard lock(call_->mutex);
  call_->token = nullptr;
}

void StallGuard::Begin() {
  if (limit_.count() == 0) {
    return;
  }
  ticket_ = timer_.At(Timer::Clock::now() + limit_, [call = call_, limit = limit_] {
    const std::lock_guard lock(call->mutex);
    if (call->token != nullptr) {
      call->token->EndForStall(limit);
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
