#include "server/log/stderr_sink.h"

#include <algorithm>
#include <cerrno>
#include <string>

#include <poll.h>
#include <unistd.h>

namespace halflight {
namespace {

constexpr int kPatienceMs = 100;
// A pipe that is ready takes as much without waiting (PIPE_BUF, pipe(7)).
constexpr size_t kPiece = 4096;

}  // namespace

void DroppingSink::sink_it_(const spdlog::details::log_msg& message) {
  if (dropped_ > 0 && HasRoom()) {
    const std::string text = notice_(dropped_);
    if (Write({message.logger_name, spdlog::level::warn, text})) {
      dropped_ = 0;
    }
  }
  if (dropped_ > 0 || !Write(message)) {
    ++dropped_;
  }
}

// False where not all of it was.
bool DroppingSink::Write(const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t line;
  formatter_->format(message, line);
  for (size_t at = 0; at < line.size();) {
    if (!HasRoom()) {
      return false;
    }
    const ssize_t wrote = write(fd_, line.data() + at, std::min(line.size() - at, kPiece));
    if (wrote < 0 && errno != EINTR) {
      return errno != EAGAIN;  // else nobody will ever read it
    }
    at += static_cast<size_t>(std::max<ssize_t>(wrote, 0));
  }
  return true;
}

bool DroppingSink::HasRoom() const {
  pollfd polled{.fd = fd_, .events = POLLOUT, .revents = 0};
  return poll(&polled, 1, dropped_ == 0 ? kPatienceMs : 0) != 0;
}

}  // namespace halflight
