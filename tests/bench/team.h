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
      : threads_(threads), barrier_(static_cast<ptrdiff_t>(threads), ForgetJobs{next_job_}) {}

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
    const auto now = Clock::now();
    timings_.push_back({stage, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
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

  // Once all have arrived, and before any goes on: who comes late must not find them new.
  struct ForgetJobs {
    std::atomic<size_t>& next_job;
    void operator()() noexcept { next_job = 0; }
  };

  size_t threads_;
  std::atomic<size_t> next_job_ = 0;
  std::barrier<ForgetJobs> barrier_;
  Clock::time_point last_;
  std::vector<StageTiming> timings_;
};

}  // namespace halflight::bench
