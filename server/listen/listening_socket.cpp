#include "server/listen/listening_socket.h"

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <memory>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <fmt/format.h>

#include "server/status_text.h"
#include "server/unix_socket.h"

namespace halflight {
namespace {

// Connections that wait to be accepted; the kernel lowers it to net.core.somaxconn.
constexpr int kBacklog = 4096;

union SocketName {
  sockaddr_storage storage;  // first, so that {} clears all of it
  sockaddr any;
  sockaddr_in v4;
  sockaddr_in6 v6;
  sockaddr_un path;
};

absl::Status CannotListen(const char* flag, const std::string& address, int error) {
  return absl::UnavailableError(
      fmt::format("{} {}: cannot listen there: {}", flag, address, std::strerror(error)));
}

bool IsLocal(const SocketName& name) {
  constexpr uint32_t kLoopbackNet = 127;
  switch (name.any.sa_family) {
    case AF_UNIX:
      return true;
    case AF_INET:
      return ntohl(name.v4.sin_addr.s_addr) >> 24U == kLoopbackNet;
    case AF_INET6: {
      const in6_addr& address = name.v6.sin6_addr;
      return IN6_IS_ADDR_LOOPBACK(&address) ||
             (IN6_IS_ADDR_V4MAPPED(&address) && address.s6_addr[12] == kLoopbackNet);
    }
    default:
      return false;
  }
}

int PortOf(const SocketName& name) {
  return ntohs(name.any.sa_family == AF_INET6 ? name.v6.sin6_port : name.v4.sin_port);
}

void SetPort(sockaddr& name, int port) {
  if (name.sa_family == AF_INET6) {
    reinterpret_cast<sockaddr_in6&>(name).sin6_port = htons(static_cast<uint16_t>(port));
  } else {
    reinterpret_cast<sockaddr_in&>(name).sin_port = htons(static_cast<uint16_t>(port));
  }
}

std::string TextOf(const SocketName& name, socklen_t length) {
  std::string host(INET6_ADDRSTRLEN, '\0');
  switch (name.any.sa_family) {
    case AF_INET:
      inet_ntop(AF_INET, &name.v4.sin_addr, host.data(), INET6_ADDRSTRLEN);
      return fmt::format("{}:{}", host.c_str(), PortOf(name));
    case AF_INET6:
      inet_ntop(AF_INET6, &name.v6.sin6_addr, host.data(), INET6_ADDRSTRLEN);
      return fmt::format("[{}]:{}", host.c_str(), PortOf(name));
    default: {
      // An abstract name starts with a zero, which is written as '@' for people.
      const size_t bytes = length - offsetof(sockaddr_un, sun_path);
      const bool is_abstract = bytes > 0 && name.path.sun_path[0] == '\0';
      return is_abstract ? "unix:@" + std::string(name.path.sun_path + 1, bytes - 1)
                         : fmt::format("unix:{}", static_cast<const char*>(name.path.sun_path));
    }
  }
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

// What a host name stands for. A host may stand in brackets, as IPv6 addresses have to.
absl::StatusOr<Addresses> Resolve(const std::string& address, const char* flag) {
  const size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), address.c_str() + colon + 1, &hints, &found);
  if (error != 0) {
    return absl::UnavailableError(
        fmt::format("{} {}: no such host: {}", flag, address, gai_strerror(error)));
  }
  return Addresses(found);
}

}  // namespace

ListeningSocket::~ListeningSocket() {
  if (fd_ < 0) {
    return;
  }
  // Before the socket closes: whoever finds the file finds a server behind it.
  if (!file_.empty()) {
    unlink(file_.c_str());
  }
  close(fd_);
}

ListeningSocket::ListeningSocket(ListeningSocket&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      flag_(other.flag_),
      address_(std::move(other.address_)),
      local_(other.local_),
      file_(std::move(other.file_)) {}

ListeningSocket& ListeningSocket::operator=(ListeningSocket&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(flag_, other.flag_);
  std::swap(address_, other.address_);
  std::swap(local_, other.local_);
  std::swap(file_, other.file_);
  return *this;
}

absl::Status ListeningSocket::Listen() {
  return listen(fd_, kBacklog) == 0 ? absl::OkStatus() : CannotListen(flag_, address_, errno);
}

absl::StatusOr<ListeningSocket> ListeningSocket::BindUnix(const std::string& address,
                                                          const std::string& path,
                                                          const char* flag) {
  if (const absl::Status status = RemoveStaleSocket(path); !status.ok()) {
    return Prefixed(fmt::format("{} {}: ", flag, address), status);
  }
  ListeningSocket made(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), flag,
                       address, true);
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  path.copy(name.sun_path, sizeof(name.sun_path) - 1);
  if (made.fd_ < 0 || bind(made.fd_, reinterpret_cast<const sockaddr*>(&name), sizeof(name)) != 0) {
    return CannotListen(flag, address, errno);
  }
  made.file_ = path;
  if (absl::Status status = made.Listen(); !status.ok()) {
    return status;
  }
  return made;
}

absl::StatusOr<std::vector<ListeningSocket>> ListeningSocket::Bind(const std::string& address,
                                                                   const char* flag) {
  std::vector<ListeningSocket> sockets;
  if (const std::string path = SocketPath(address); !path.empty()) {
    auto made = BindUnix(address, path, flag);
    if (!made.ok()) {
      return made.status();
    }
    sockets.push_back(*std::move(made));
    return sockets;
  }
  const auto places = Resolve(address, flag);
  if (!places.ok()) {
    return places.status();
  }
  int port = 0;
  absl::Status skipped;
  for (addrinfo* place = places->get(); place != nullptr; place = place->ai_next) {
    if (port != 0) {
      SetPort(*place->ai_addr, port);
    }
    ListeningSocket made(
        socket(place->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_TCP), flag,
        address, false);
    const int yes = 1;
    // A restarted server need not wait for its predecessor's connections to be forgotten.
    if (made.fd_ < 0 || setsockopt(made.fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes)) != 0 ||
        bind(made.fd_, place->ai_addr, place->ai_addrlen) != 0) {
      // "localhost" also stands for ::1 where there is no IPv6.
      if (errno == EAFNOSUPPORT || errno == EADDRNOTAVAIL) {
        skipped = CannotListen(flag, address, errno);
        continue;
      }
      return CannotListen(flag, address, errno);
    }
    SocketName name{};
    socklen_t length = sizeof(name);
    getsockname(made.fd_, &name.any, &length);
    port = PortOf(name);
    made.local_ = IsLocal(name);
    made.address_ = address.substr(0, address.rfind(':') + 1) + std::to_string(port);
    sockets.push_back(std::move(made));
  }
  if (sockets.empty()) {
    return skipped;
  }
  return sockets;
}

absl::StatusOr<std::vector<ListeningSocket>> ListeningSocket::BindAll(
    const std::vector<std::string>& addresses, std::vector<ListeningSocket> given) {
  for (const std::string& address : addresses) {
    auto bound = Bind(address);
    if (!bound.ok()) {
      return bound.status();
    }
    std::move(bound->begin(), bound->end(), std::back_inserter(given));
  }
  return given;
}

absl::StatusOr<ListeningSocket> ListeningSocket::Adopt(int fd) {
  int listens = 0;
  int type = 0;
  socklen_t length = sizeof(int);
  SocketName name{};
  socklen_t name_length = sizeof(name);
  if (getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listens, &length) != 0 || listens == 0 ||
      getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_STREAM ||
      getsockname(fd, &name.any, &name_length) != 0 ||
      (name.any.sa_family != AF_INET && name.any.sa_family != AF_INET6 &&
       name.any.sa_family != AF_UNIX)) {
    return absl::InvalidArgumentError(fmt::format(
        "descriptor {} that was handed over: allowed: stream sockets of TCP or unix that listen",
        fd));
  }
  fcntl(fd, F_SETFD, FD_CLOEXEC);
  fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  return ListeningSocket(fd, "LISTEN_FDS", TextOf(name, name_length), IsLocal(name));
}

}  // namespace halflight
