// Turns SIGINT, SIGTERM and SIGHUP into a stop request, so that a command unwinds: calls are
// cancelled, files removed, the server ended. A second signal ends the process at once. One that
// the process was told to ignore does nothing. Leaves SIGPIPE alone, which the commands ignore.
#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

namespace halflight::client {

// Make one in main before any other thread, which then inherits the blocked signals.
class InterruptWatch {
 public:
  InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  ~InterruptWatch();

  [[nodiscard]] std::stop_token stop() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

}  // namespace halflight::client
