// When frames were told to stop, of those that have not come back yet: how a device that hangs is
// noticed.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>

namespace halflight {

// All calls: any thread.
class StopTimes {
 public:
  using Clock = std::chrono::steady_clock;

  // A frame, until it has come back.
  class Frame {
   public:
    // `of` outlives it.
    Frame(StopTimes& of, std::stop_token stop);
    ~Frame();
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;
    Frame(Frame&&) = delete;
    Frame& operator=(Frame&&) = delete;

   private:
    friend StopTimes;

    StopTimes& of_;
    std::atomic<Clock::time_point> told_{Clock::time_point::max()};
    std::stop_callback<std::function<void()>> on_stop_;
  };

  std::unique_ptr<Frame> Watch(std::stop_token stop);

  // When the one of them was told that was told first; none where none was.
  [[nodiscard]] std::optional<Clock::time_point> first() const;

 private:
  mutable std::mutex mutex_;
  std::set<const Frame*> frames_;  // guarded by mutex_
};

}  // namespace halflight
