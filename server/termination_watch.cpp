#include "server/termination_watch.h"

#include <cstdlib>
#include <utility>

#include "server/log/log.h"

namespace halflight {
namespace {

// What the end of a watch may wait for.
constexpr timespec kLook{.tv_sec = 0, .tv_nsec = 10'000'000};

}  // namespace

TerminationWatch::TerminationWatch(const sigset_t& signals,
                                   std::optional<std::chrono::seconds> most, ImmediateEnd end)
    : thread_([signals, most, end = std::move(end)](const std::stop_token& stop) {
        const auto begin = std::chrono::steady_clock::now();
        while (!stop.stop_requested()) {
          if (sigtimedwait(&signals, nullptr, &kLook) > 0 ||
              (most.has_value() && std::chrono::steady_clock::now() - begin >= *most)) {
            Log(end.exit_code == 0 ? LogLevel::kInfo : LogLevel::kError, end.event,
                {{"message", end.message}});
            std::_Exit(end.exit_code);
          }
        }
      }) {}

}  // namespace halflight
