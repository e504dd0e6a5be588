#include "server/listen/connections.h"

#include <utility>

#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

namespace halflight {
namespace {

constexpr std::chrono::milliseconds kLookAgain{5};

// 0 where it is no socket.
uint64_t CookieOf(int fd) {
  uint64_t cookie = 0;
  socklen_t length = sizeof(cookie);
  return getsockopt(fd, SOL_SOCKET, SO_COOKIE, &cookie, &length) == 0 ? cookie : 0;
}

}  // namespace

bool Connections::Add(int fd, size_t limit) {
  const std::lock_guard lock(mutex_);
  if (open_.size() >= limit && Clock::now() - looked_ >= kLookAgain) {
    ForgetClosed();
  }
  if (open_.size() >= limit) {
    return false;
  }
  open_[fd] = {.cookie = CookieOf(fd), .patience = {}};
  ++added_;
  return true;
}

size_t Connections::Count() {
  const std::lock_guard lock(mutex_);
  ForgetClosed();
  return open_.size();
}

uint64_t Connections::added() const {
  const std::lock_guard lock(mutex_);
  return added_;
}

void Connections::ForgetClosed() {
  std::erase_if(open_,
                [](const auto& entry) { return CookieOf(entry.first) != entry.second.cookie; });
  looked_ = Clock::now();
}

void Connections::HangUp() { ShutDown(SHUT_RD); }

void Connections::CutOff() { ShutDown(SHUT_RDWR); }

void Connections::ShutDown(int how) {
  const std::lock_guard lock(mutex_);
  ForgetClosed();
  for (const auto& [fd, connection] : open_) {
    shutdown(fd, how);
  }
}

void Connections::CutOffStalled(const PatienceLimits& limits, std::chrono::milliseconds apart) {
  const std::lock_guard lock(mutex_);
  ForgetClosed();
  const auto waited = looked_ - std::exchange(looked_for_stalled_, looked_);
  for (auto& [fd, connection] : open_) {
    const Backlog before = std::exchange(connection.backlog, BacklogOf(fd));
    const auto& [unread, taken] = connection.backlog;
    auto& patience = connection.patience;
    if (!patience.has_value() || waited > 3 * apart || unread == 0 ||
        (!taken.has_value() && unread != before.unread)) {
      patience = Patience(limits);
      continue;
    }
    patience->Spend(waited, taken.value_or(0) - before.taken.value_or(0));
    if (patience->left().count() == 0) {
      shutdown(fd, SHUT_RDWR);
    }
  }
}

Connections::Backlog Connections::BacklogOf(int fd) {
  Backlog backlog;
  ioctl(fd, SIOCOUTQ, &backlog.unread);
  tcp_info info{};
  socklen_t length = sizeof(info);
  if (getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &length) == 0) {
    backlog.taken = info.tcpi_bytes_acked;
  }
  return backlog;
}

}  // namespace halflight
