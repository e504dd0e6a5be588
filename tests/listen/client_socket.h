// Plain sockets as clients, for tests of a listener.
#pragma once

#include <cstdlib>
#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace halflight::testing {

class ClientSocket {
 public:
  // AF_INET or AF_UNIX.
  explicit ClientSocket(int family = AF_INET)
      : fd_(socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
  ~ClientSocket() { Close(); }
  ClientSocket(ClientSocket&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  ClientSocket& operator=(ClientSocket&&) = delete;
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  // "127.0.0.1:port" or "unix:path", as its family is. The kernel connects as long as the backlog
  // has room.
  bool Connect(const std::string& address) const {
    if (address.rfind("unix:", 0) == 0) {
      sockaddr_un path{};
      path.sun_family = AF_UNIX;
      address.copy(path.sun_path, sizeof(path.sun_path) - 1, 5);
      return connect(fd_, reinterpret_cast<const sockaddr*>(&path), sizeof(path)) == 0;
    }
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    name.sin_port =
        htons(static_cast<uint16_t>(std::atoi(address.substr(address.rfind(':') + 1).c_str())));
    return connect(fd_, reinterpret_cast<const sockaddr*>(&name), sizeof(name)) == 0;
  }
  bool Send(const std::string& bytes) const {
    return send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  // Whether the other side hangs up within the time; what it says before is thrown away.
  [[nodiscard]] bool HangsUpWithin(int milliseconds) const {
    pollfd polled{.fd = fd_, .events = POLLIN, .revents = 0};
    char bytes[4096];
    while (poll(&polled, 1, milliseconds) > 0) {
      if (recv(fd_, bytes, sizeof(bytes), 0) <= 0) {
        return true;
      }
    }
    return false;
  }
  void Close() {
    if (fd_ >= 0) {
      close(fd_);
      fd_ = -1;
    }
  }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace halflight::testing
