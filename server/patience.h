// How long a peer may yet keep somebody waiting.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace halflight {

struct PatienceLimits {
  std::chrono::nanoseconds at_once{};  // also all that there is at first
  // Time that a peer has been waited for is won back by what it has taken, or sent, meanwhile: a
  // second for so many bytes. 0: all of it, whatever it was.
  uint64_t bytes_per_second = 0;
};

// Without it one that takes a little now and then would be waited for as long as it likes.
class Patience {
 public:
  explicit Patience(const PatienceLimits& limits) : limits_(limits) {}

  void Restore() { left_ = limits_.at_once; }
  // `waited`: for a peer that has taken, or sent, so many bytes in that time.
  void Spend(std::chrono::nanoseconds waited, uint64_t bytes) {
    if (limits_.bytes_per_second == 0 && bytes > 0) {
      Restore();
      return;
    }
    using Seconds = std::chrono::duration<double>;
    Seconds left = left_ - waited;
    if (bytes > 0) {
      left += Seconds(static_cast<double>(bytes) / static_cast<double>(limits_.bytes_per_second));
    }
    left = std::clamp<Seconds>(left, Seconds(0.0), limits_.at_once);
    left_ = std::chrono::duration_cast<std::chrono::nanoseconds>(left);
  }
  // 0: none.
  [[nodiscard]] std::chrono::nanoseconds left() const { return left_; }

 private:
  PatienceLimits limits_;
  std::chrono::nanoseconds left_ = limits_.at_once;
};

}  // namespace halflight
