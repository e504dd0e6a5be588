#include "server/timer.h"

namespace halflight {

Timer::Timer() : thread_([this] { Work(); }) {}

Timer::~Timer() {
  const std::lock_guard lock(mutex_);
  closing_ = true;
  changed_.notify_all();
}

Timer::Ticket Timer::At(Clock::time_point time, std::function<void()> call) {
  const std::lock_guard lock(mutex_);
  const Ticket ticket{time, next_++};
  const auto place = calls_.emplace(ticket, std::move(call)).first;
  if (place == calls_.begin()) {
    changed_.notify_all();
  }
  return ticket;
}

void Timer::Cancel(const Ticket& ticket) {
  std::function<void()> forgotten;  // freed after the lock is: it may own what uses this timer
  const std::lock_guard lock(mutex_);
  if (const auto found = calls_.find(ticket); found != calls_.end()) {
    forgotten = std::move(found->second);
    calls_.erase(found);
  }
}

void Timer::Work() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    if (calls_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const auto first = calls_.begin();
    if (Clock::now() < first->first.first) {
      const Clock::time_point time = first->first.first;
      changed_.wait_until(lock, time);
      continue;
    }
    std::function<void()> call = std::move(first->second);
    calls_.erase(first);
    lock.unlock();
    call();
    call = nullptr;
    lock.lock();
  }
}

}  // namespace halflight
