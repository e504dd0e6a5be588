// Sockets that clients connect to: made from addresses, or handed over by a service manager.
// Accepting stands in acceptor.h.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace halflight {

class ListeningSocket {
 public:
  // Takes every place that "host:port" or "unix:path" stands for: of a name with several addresses
  // each, on the same port; port 0 takes a free one. A unix socket listens at once, so that no
  // other server takes its file for a dead one's; a TCP socket refuses connections until Listen.
  // AlreadyExists, Unavailable and InvalidArgument "<flag> <address>: <why>".
  static absl::StatusOr<std::vector<ListeningSocket>> Bind(const std::string& address,
                                                           const char* flag = "--address");

  // The sockets of all addresses, behind those `given`.
  static absl::StatusOr<std::vector<ListeningSocket>> BindAll(
      const std::vector<std::string>& addresses, std::vector<ListeningSocket> given = {});

  // A socket of this process that listens already, such as one of systemd's. InvalidArgument for
  // any other descriptor. The file of a unix socket stays when this goes.
  static absl::StatusOr<ListeningSocket> Adopt(int fd);

  // Stops listening; removes the file of a unix socket that Bind made.
  ~ListeningSocket();
  ListeningSocket(ListeningSocket&& other) noexcept;
  ListeningSocket& operator=(ListeningSocket&& other) noexcept;
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  // From now on clients can connect.
  absl::Status Listen();

  [[nodiscard]] int fd() const { return fd_; }
  // As it was asked for, with the port that was taken for 0.
  [[nodiscard]] const std::string& address() const { return address_; }
  // Whether only this machine can connect: a loopback address or a unix socket.
  [[nodiscard]] bool local() const { return local_; }

 private:
  ListeningSocket(int fd, const char* flag, std::string address, bool local)
      : fd_(fd), flag_(flag), address_(std::move(address)), local_(local) {}

  static absl::StatusOr<ListeningSocket> BindUnix(const std::string& address,
                                                  const std::string& path, const char* flag);

  int fd_ = -1;
  const char* flag_;  // that asked for it
  std::string address_;
  bool local_ = false;
  std::string file_;  // to be removed; empty: none
};

}  // namespace halflight
