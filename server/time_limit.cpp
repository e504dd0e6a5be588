#include "server/time_limit.h"

#include <utility>

namespace halflight {

TimeLimit::TimeLimit(Timer& timer, std::chrono::milliseconds allowed,
                     std::function<void()> exceeded)
    : timer_(timer), exceeded_(std::move(exceeded)) {
  if (allowed != std::chrono::milliseconds::max()) {
    left_ = allowed;
  }
}

void TimeLimit::Run() {
  if (ticket_.has_value() || !left_.has_value()) {
    return;
  }
  since_ = Clock::now();
  ticket_ = timer_.At(since_ + *left_, exceeded_);
}

void TimeLimit::Pause() {
  if (!ticket_.has_value()) {
    return;
  }
  timer_.Cancel(*ticket_);
  ticket_.reset();
  *left_ -= Clock::now() - since_;
}

}  // namespace halflight
