#include "server/supervision.h"

#include <fmt/format.h>

#include "renderer/block_cache.h"
#include "renderer/kept_memory.h"
#include "server/log/log.h"
#include "server/service_manager.h"
#include "server/status_text.h"

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

// How often the device is looked at.
constexpr timespec kLook{.tv_sec = 0, .tv_nsec = 250'000'000};
// How long no frame may come before memory goes back: longer than the pauses of somebody at work,
// who would wait for it to be taken again.
constexpr std::chrono::seconds kIdle(10);
// So that a peak is not kept for ever by a few frames a minute.
constexpr std::chrono::minutes kAtLeastEvery(5);
// How often a drain looks whether it is over.
constexpr timespec kDrainPoll{.tv_sec = 0, .tv_nsec = 20'000'000};

}  // namespace

std::optional<std::string> DeviceTrouble(const EngineState& state, std::chrono::seconds patience,
                                         Clock::time_point now) {
  if (!state.end.ok()) {
    return MessageOf(state.end);
  }
  if (patience.count() > 0 && state.overdue_since.has_value() &&
      now - *state.overdue_since > patience) {
    return fmt::format("the device hangs: told to stop, it has not come back for {} s",
                       patience.count());
  }
  return std::nullopt;
}

Supervision::Supervision(GrpcServer& server, const FrameEngine& engine, const Backend& backend,
                         const sigset_t& signals, std::chrono::seconds patience)
    : server_(server), engine_(engine), backend_(backend), signals_(signals), patience_(patience) {}

std::optional<int> Supervision::WaitForEnd() {
  const auto heartbeat = WatchdogInterval();
  Clock::time_point next_heartbeat = Clock::now();
  Clock::time_point next_idle_look = Clock::now() + kIdle;
  while (true) {
    if (const int signal = sigtimedwait(&signals_, nullptr, &kLook); signal > 0) {
      return signal;
    }
    const auto now = Clock::now();
    if (const auto trouble = DeviceTrouble(engine_.state(), patience_, now)) {
      Log(LogLevel::kError, "device_lost", {{"message", *trouble}});
      return std::nullopt;
    }
    if (heartbeat.has_value() && now >= next_heartbeat) {
      NotifyServiceManager("WATCHDOG=1");
      next_heartbeat = now + *heartbeat / 2;
    }
    if (now >= next_idle_look) {
      GiveMemoryBack();
      next_idle_look = now + kIdle;
    }
  }
}

void Supervision::GiveMemoryBack() {
  backend_.partial_uploads.DropExpired();
  const uint64_t frames = backend_.pipeline.accepted();
  const uint64_t work = frames + server_.calls_begun();
  const bool rests = backend_.pipeline.idle() && frames == frames_seen_;
  const auto now = Clock::now();
  if (work != given_back_ && (rests || now - last_given_back_ >= kAtLeastEvery)) {
    BlockCache::Release();
    GiveBackFreedMemory();
    given_back_ = work;
    last_given_back_ = now;
  }
  frames_seen_ = frames;
}

bool Supervision::Drain(std::chrono::milliseconds most) {
  const auto until = Clock::now() + most;
  server_.BeginDrain();
  while (!server_.idle() || !backend_.pipeline.idle() || !backend_.store.idle()) {
    if (sigtimedwait(&signals_, nullptr, &kDrainPoll) > 0 || Clock::now() >= until) {
      return false;
    }
  }
  return true;
}

}  // namespace halflight
