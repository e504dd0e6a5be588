#include "server/stall_guard.h"

#include <mutex>

#include <spdlog/spdlog.h>

namespace halflight {

// What the timer's call may still hold when the guard and its context are gone.
struct StallGuard::Call {
  // Recursive: gRPC may end the call, and with it the guard, before TryCancel returns.
  std::recursive_mutex mutex;
  grpc::CallbackServerContext* context;  // null: gone
};

StallGuard::StallGuard(Timer& timer, std::chrono::seconds limit,
                       grpc::CallbackServerContext& context)
    : timer_(timer), limit_(limit), call_(std::make_shared<Call>()) {
  call_->context = &context;
}

StallGuard::~StallGuard() {
  End();
  const std::lock_guard lock(call_->mutex);
  call_->context = nullptr;
}

void StallGuard::Begin() {
  if (limit_.count() == 0) {
    return;
  }
  ticket_ = timer_.At(Timer::Clock::now() + limit_, [call = call_, limit = limit_] {
    const std::lock_guard lock(call->mutex);
    if (call->context != nullptr) {
      spdlog::warn("call stalled peer={} seconds={}", call->context->peer(), limit.count());
      call->context->TryCancel();
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
