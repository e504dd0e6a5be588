#include "server/shared_by_calls.h"

#include <algorithm>

namespace halflight {
namespace {

// What a call has to end in, once it is cancelled.
constexpr std::chrono::milliseconds kToEnd{5000};

}  // namespace

std::function<void()> SharedByCalls::EndForStall(CallToken& token) {
  return [this, &token] {
    const auto to_end = std::min(kToEnd, stall_limit());
    connections.HangUpOnStalled(to_end);
    timer.At(Timer::Clock::now() + to_end, [this, to_end] { connections.HangUpOnStalled(to_end); });
    token.EndForStall(std::chrono::duration_cast<std::chrono::seconds>(stall_limit()));
  };
}

}  // namespace halflight
