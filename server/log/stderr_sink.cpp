#include "server/log/stderr_sink.h"

#include <algorithm>
#include <cerrno>
#include <string>
#include <string_view>

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

// False where not all of it was. What follows part of a line begins one of its own.
bool DroppingSink::Write(const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t line;
  if (torn_) {
    line.push_back('\n');
  }
  formatter_->format(message, line);  // behind what is there
  std::string_view left(line.data(), line.size());
  while (!left.empty()) {
    if (!HasRoom()) {
      return false;
    }
    const ssize_t wrote = write(fd_, left.data(), std::min(left.size(), kPiece));
    if (wrote < 0 && errno != EINTR) {
      return errno == EPIPE;  // nobody will ever read it, so none is missed
    }
    left.remove_prefix(static_cast<size_t>(std::max<ssize_t>(wrote, 0)));
    torn_ = !left.empty() && (torn_ || wrote > 0);
  }
  return true;
}

bool DroppingSink::HasRoom() const {
  pollfd polled{.fd = fd_, .events = POLLOUT, .revents = 0};
  return poll(&polled, 1, dropped_ == 0 ? kPatienceMs : 0) > 0;
}

}  // namespace halflight
