// Ends the process while its main thread is at something that may never come back: a driver that
// hangs while the service starts, or while everything is put away.
#pragma once

#include <chrono>
#include <csignal>
#include <optional>
#include <string>
#include <thread>

namespace halflight {

struct ImmediateEnd {
  int exit_code = 0;
  const char* event = "";  // of the log
  std::string message;
};

class TerminationWatch {
 public:
  // While it lives, one of `signals`, which are blocked, ends the process at once, without any
  // destructor; so does the end of `most`, where there is one.
  TerminationWatch(const sigset_t& signals, std::optional<std::chrono::seconds> most,
                   ImmediateEnd end);

 private:
  std::jthread thread_;
};

}  // namespace halflight
