#include "server/unix_socket.h"

#include <cerrno>
#include <cstring>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <fmt/format.h>

namespace halflight {
namespace {

// Why there may be a server: one that we may not talk to, for one. Empty where there is none.
std::string WhyNotDead(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (probe < 0) {
    return std::strerror(errno);
  }
  const int connected = connect(probe, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  const int error = connected == 0 ? 0 : errno;
  close(probe);
  // A full backlog, too, means that somebody is there.
  return error == ECONNREFUSED           ? ""
         : error == 0 || error == EAGAIN ? "it answers"
                                         : std::strerror(error);
}

}  // namespace

std::string SocketPath(const std::string& address) {
  constexpr const char* kScheme = "unix:";
  return address.rfind(kScheme, 0) == 0 ? address.substr(std::strlen(kScheme)) : "";
}

absl::Status RemoveStaleSocket(const std::string& path) {
  struct stat info {};
  if (lstat(path.c_str(), &info) != 0) {
    return absl::OkStatus();
  }
  if (!S_ISSOCK(info.st_mode)) {
    return absl::AlreadyExistsError(fmt::format("{} exists and is not a socket", path));
  }
  if (const std::string why = WhyNotDead(path); !why.empty()) {
    return absl::AlreadyExistsError(fmt::format("another server listens on {}: {}", path, why));
  }
  unlink(path.c_str());
  return absl::OkStatus();
}

}  // namespace halflight
