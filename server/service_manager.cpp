#include "server/service_manager.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <fmt/format.h>

#include "absl/strings/numbers.h"
#include "server/status_text.h"

namespace halflight {
namespace {

constexpr int kFirstInherited = 3;
constexpr int kMostInherited = 64;

std::string Variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

absl::StatusOr<std::vector<ListeningSocket>> TakeInheritedSockets() {
  const std::string pid = Variable("LISTEN_PID");
  const std::string count_text = Variable("LISTEN_FDS");
  for (const char* name : {"LISTEN_PID", "LISTEN_FDS", "LISTEN_FDNAMES"}) {
    unsetenv(name);
  }
  std::vector<ListeningSocket> sockets;
  // Of another process: a parent's, whose descriptors are not here.
  if (pid != std::to_string(getpid())) {
    return sockets;
  }
  int count = 0;
  if (!absl::SimpleAtoi(count_text, &count) || count < 0 || count > kMostInherited) {
    return absl::InvalidArgumentError(
        fmt::format("LISTEN_FDS: {}, allowed: 0 to {}", count_text, kMostInherited));
  }
  for (int fd = kFirstInherited; fd < kFirstInherited + count; ++fd) {
    auto socket = ListeningSocket::Adopt(fd);
    if (!socket.ok()) {
      return Prefixed("LISTEN_FDS: ", socket.status());
    }
    sockets.push_back(*std::move(socket));
  }
  return sockets;
}

std::optional<std::chrono::microseconds> WatchdogInterval() {
  const std::string pid = Variable("WATCHDOG_PID");
  int64_t microseconds = 0;
  if ((!pid.empty() && pid != std::to_string(getpid())) ||
      !absl::SimpleAtoi(Variable("WATCHDOG_USEC"), &microseconds) || microseconds <= 0) {
    return std::nullopt;
  }
  return std::chrono::microseconds(microseconds);
}

void NotifyServiceManager(const char* state) {
  const std::string path = Variable("NOTIFY_SOCKET");
  sockaddr_un name{};
  if (path.empty() || path.size() >= sizeof(name.sun_path)) {
    return;
  }
  name.sun_family = AF_UNIX;
  path.copy(name.sun_path, sizeof(name.sun_path) - 1);
  if (name.sun_path[0] == '@') {
    name.sun_path[0] = '\0';  // an abstract name
  }
  // Kept: who has no descriptor left is as well as before, and has to say so.
  static const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  sendto(fd, state, std::strlen(state), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&name),
         length);
}

}  // namespace halflight
