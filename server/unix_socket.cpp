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

// Where it cannot be told, as of a server that we may not talk to, somebody does.
bool SomebodyListens(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (probe < 0) {
    return true;
  }
  const int connected = connect(probe, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  const bool listens = connected == 0 || errno != ECONNREFUSED;
  close(probe);
  return listens;
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
  if (SomebodyListens(path)) {
    return absl::AlreadyExistsError(fmt::format("another server listens on {}", path));
  }
  unlink(path.c_str());
  return absl::OkStatus();
}

}  // namespace halflight
