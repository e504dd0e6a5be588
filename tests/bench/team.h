// Threads that run the stages of one frame together, and how long each stage takes.
// Leaves out what they do.
#pragma once

#include <atomic>
#include <barrier>
#include <chrono>
#include <cstddef>
#include <thread>
#include <utility>
#include <vector>

#include "renderer/frame.h"

namespace halflight::bench {

// All threads run the same function, and wait for one another after each stage.
class Team {
 public:
  explicit Team(size_t threads)
      : threads_(threads), barrier_(static_cast<ptrdiff_t>(threads), AtArrival{*this}) {}

  [[nodiscard]] size_t threads() const { return threads_; }

  // Runs `work(thread)` on every thread.
  template <typename Work>
  void Run(const Work& work) {
    last_ = Clock::now();
    std::vector<std::jthread> others;
    for (size_t t = 1; t < threads_; ++t) others.emplace_back([&work, t] { work(t); });
    work(0);
  }

  void Wait() { barrier_.arrive_and_wait(); }
  // The same, at the end of a stage.
  void EndStage(size_t thread, const char* stage) {
    Wait();
    if (thread != 0) return;
    timings_.push_back(
        {stage, std::chrono::duration<double, std::milli>(arrived_ - last_).count()});
    last_ = arrived_;
  }

  // Of this thread, [begin, end) of `count`.
  [[nodiscard]] std::pair<size_t, size_t> Share(size_t thread, size_t count) const {
    return {count * thread / threads_, count * (thread + 1) / threads_};
  }
  // The next of this stage's jobs that no thread has begun.
  size_t TakeJob() { return next_job_++; }

  std::vector<StageTiming> timings() && { return std::move(timings_); }

 private:
  using Clock = std::chrono::steady_clock;

  // Once all have arrived, and before any goes on: who wakes late must not find the jobs new, and
  // when it woke is not when the stage ended.
  struct AtArrival {
    Team& team;
    void operator()() noexcept {
      team.next_job_ = 0;
      team.arrived_ = Clock::now();
    }
  };

  size_t threads_;
  std::atomic<size_t> next_job_ = 0;
  std::barrier<AtArrival> barrier_;
  Clock::time_point last_;  // when the stage before ended
  Clock::time_point arrived_;
  std::vector<StageTiming> timings_;
};

}  // namespace halflight::bench
