#include "client/retry.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <string>

#include "absl/strings/cord.h"

namespace halflight::client {

namespace {

constexpr const char* kPayload = "halflight/retry-after-ms";

}  // namespace

absl::Status WithRetryHint(absl::Status status, std::optional<std::chrono::milliseconds> hint) {
  if (hint) {
    status.SetPayload(kPayload, absl::Cord(std::to_string(hint->count())));
  }
  return status;
}

std::optional<std::chrono::milliseconds> RetryHint(const absl::Status& status) {
  const auto payload = status.GetPayload(kPayload);
  return payload ? std::optional(
                       std::chrono::milliseconds(std::stoll(static_cast<std::string>(*payload))))
                 : std::nullopt;
}

bool IsRetryable(const absl::Status& status) {
  return status.code() == absl::StatusCode::kUnavailable ||
         (status.code() == absl::StatusCode::kResourceExhausted && RetryHint(status));
}

Backoff::Backoff(std::chrono::milliseconds first, unsigned seed) : first_(first), random_(seed) {}

std::chrono::milliseconds Backoff::Next(std::optional<std::chrono::milliseconds> hint) {
  constexpr std::chrono::milliseconds kLongest{5000};
  const auto whole = std::min(kLongest, first_ * (1 << std::min(waits_++, 20)));
  std::uniform_int_distribution<std::chrono::milliseconds::rep> between(whole.count() / 2,
                                                                        whole.count());
  const std::chrono::milliseconds wait(between(random_));
  // A hint beyond a minute is taken for a fault rather than obeyed.
  return hint ? std::max(wait, std::min(*hint, std::chrono::milliseconds(60000))) : wait;
}

bool SleepUnlessStopped(std::chrono::milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_for(lock, stop, time, [] { return false; });
  return !stop.stop_requested();
}

}  // namespace halflight::client
