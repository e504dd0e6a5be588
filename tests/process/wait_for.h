// Waiting for what another thread or process does, without saying how long that takes.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace halflight::testing {

// Until `ready` holds, a minute at most; whether it does.
inline bool WaitFor(const std::function<bool()>& ready) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!ready()) {
    if (std::chrono::steady_clock::now() >= until) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace halflight::testing
