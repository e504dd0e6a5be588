#include "client/cli/interrupt.h"

#include <pthread.h>
#include <unistd.h>

#include <csignal>

#include "client/cli/exit_code.h"

namespace halflight::client {

namespace {

// As nohup and the & of a shell leave it: being blocked, the signal comes all the same.
bool IsIgnored(int signal) {
  struct sigaction action {};
  sigaction(signal, nullptr, &action);
  return action.sa_handler == SIG_IGN;
}

}  // namespace

InterruptWatch::InterruptWatch() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    sigaddset(&signals, signal);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  thread_ = std::thread([this, signals] {
    int signal = 0;
    while (sigwait(&signals, &signal) == 0 && !over_) {
      if (!IsIgnored(signal) && !source_.request_stop()) {
        _exit(static_cast<int>(ExitCode::kInterrupted));
      }
    }
  });
}

InterruptWatch::~InterruptWatch() {
  over_ = true;
  // Wakes the thread that waits, which is the only one to get it.
  pthread_kill(thread_.native_handle(), SIGHUP);
  thread_.join();
}

}  // namespace halflight::client
