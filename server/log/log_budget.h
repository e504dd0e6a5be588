// Keeps the log from being filled by whoever likes to be complained of.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

namespace halflight {

// Any thread.
class LogBudget {
 public:
  using Clock = std::chrono::steady_clock;

  // So many lines of a kind in ten seconds.
  explicit LogBudget(int lines) : lines_(lines) {}

  // How many there were since the last one that was written, this one among them; none where this
  // one is not to be written.
  std::optional<uint64_t> Take(Clock::time_point now = Clock::now()) {
    constexpr std::chrono::seconds kInterval{10};
    const std::lock_guard lock(mutex_);
    ++since_last_told_;
    if (!begun_.has_value() || now - *begun_ >= kInterval) {
      begun_ = now;
      written_ = 0;
    }
    if (written_ >= lines_) {
      return std::nullopt;
    }
    ++written_;
    const uint64_t count = since_last_told_;
    since_last_told_ = 0;
    return count;
  }

 private:
  const int lines_;
  std::mutex mutex_;
  std::optional<Clock::time_point> begun_;
  int written_ = 0;
  uint64_t since_last_told_ = 0;
};

}  // namespace halflight
