// When a failed call is worth another try, and how long to wait before it.
// Knows nothing of gRPC; the calls are made in client.cpp and sequence.cpp.
#pragma once

#include <chrono>
#include <optional>
#include <random>
#include <stop_token>

#include "absl/status/status.h"

namespace halflight::client {

// The least time that the server asks to wait before another try, kept with its status.
absl::Status WithRetryHint(absl::Status status, std::optional<std::chrono::milliseconds> hint);
std::optional<std::chrono::milliseconds> RetryHint(const absl::Status& status);

// UNAVAILABLE, and RESOURCE_EXHAUSTED with a hint: without one it is gRPC's own, of a message that
// is too large, and will be so again.
bool IsRetryable(const absl::Status& status);

// Exponential backoff with full jitter in its upper half: the n-th wait lies between half of and
// the whole of first * 2^n, 5 s at most, so that clients refused together do not come back
// together.
class Backoff {
 public:
  explicit Backoff(std::chrono::milliseconds first, unsigned seed = std::random_device{}());

  // The next wait. `hint` is what the server asked for: the least to wait.
  std::chrono::milliseconds Next(std::optional<std::chrono::milliseconds> hint = std::nullopt);
  void Reset() { waits_ = 0; }

 private:
  std::chrono::milliseconds first_;
  int waits_ = 0;
  std::mt19937 random_;
};

// False when `stop` was requested before the time was over.
bool SleepUnlessStopped(std::chrono::milliseconds time, const std::stop_token& stop);

}  // namespace halflight::client
