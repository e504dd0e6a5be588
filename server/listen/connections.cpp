#include "server/listen/connections.h"

#include <algorithm>
#include <utility>
#include <vector>

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

Connections::Addition Connections::Add(int fd, const std::string& machine,
                                       const ConnectionLimits& limits) {
  const std::lock_guard lock(mutex_);
  Addition addition = RoomFor(machine, limits);
  if (addition != Addition::kDone && Clock::now() - looked_ >= kLookAgain) {
    ForgetClosed();
    addition = RoomFor(machine, limits);
  }
  if (addition == Addition::kDone) {
    Forget(fd);  // closed, and the descriptor is another's now
    open_[fd] = {.cookie = CookieOf(fd), .machine = machine, .patience = {}};
    machines_.Add(machine);
    ++added_;
  }
  return addition;
}

Connections::Addition Connections::RoomFor(const std::string& machine,
                                           const ConnectionLimits& limits) const {
  return open_.size() >= limits.all                    ? Addition::kFull
         : machines_.Of(machine) >= limits.one_machine ? Addition::kMachineFull
                                                       : Addition::kDone;
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

void Connections::Forget(int fd) {
  if (const auto closed = open_.find(fd); closed != open_.end()) {
    machines_.Remove(closed->second.machine);
    open_.erase(closed);
  }
}

void Connections::ForgetClosed() {
  std::vector<int> closed;
  for (const auto& [fd, connection] : open_) {
    if (CookieOf(fd) != connection.cookie) {
      closed.push_back(fd);
    }
  }
  std::for_each(closed.begin(), closed.end(), [this](int fd) { Forget(fd); });
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
    const auto& [unread, full, taken] = connection.backlog;
    const bool progress = taken.has_value() ? taken != before.taken : unread != before.unread;
    auto& patience = connection.patience;
    if (!patience.has_value() || waited > 3 * apart || unread == 0 || (progress && !full)) {
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
    backlog.full = info.tcpi_notsent_bytes > 0;
  }
  return backlog;
}

}  // namespace halflight
