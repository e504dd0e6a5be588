// Waiting for what another thread or process does, without saying how long that takes.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace halflight::testing {

// Until `ready` holds, a minute at most unless said otherwise; whether it does.
inline bool WaitFor(const std::function<bool()>& ready,
                    std::chrono::seconds at_most = std::chrono::minutes(1)) {
  const auto until = std::chrono::steady_clock::now() + at_most;
  while (!ready()) {
    if (std::chrono::steady_clock::now() >= until) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace halflight::testing
