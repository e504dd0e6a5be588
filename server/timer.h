// Calls functions at given times, on one thread of its own. For watching over work, not for doing
// it: a function that takes long holds up the others.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace halflight {

class Timer {
 public:
  using Clock = std::chrono::steady_clock;
  // Of one call that is to come; never that of another.
  using Ticket = std::pair<Clock::time_point, uint64_t>;

  Timer();
  // Calls nothing any more.
  ~Timer();
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;
  Timer(Timer&&) = delete;
  Timer& operator=(Timer&&) = delete;

  // Any thread. `call` must not throw, and may use this timer.
  Ticket At(Clock::time_point time, std::function<void()> call);
  // Forgets the call; one that has begun goes on. Any thread.
  void Cancel(const Ticket& ticket);

 private:
  void Work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Ticket, std::function<void()>> calls_;
  uint64_t next_ = 0;
  bool closing_ = false;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace halflight
