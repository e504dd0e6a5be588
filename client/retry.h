// When a failed call is worth another try, and how long to wait before it.
// Knows nothing of gRPC; the calls are made in client.cpp and sequence.cpp.
#pragma once

#include <chrono>
#include <optional>
#include <random>
#include <stop_token>

#include "absl/status/status.h"

namespace halflight::client {

// The codes that service.proto says to retry: UNAVAILABLE and RESOURCE_EXHAUSTED.
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
