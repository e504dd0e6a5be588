#include "server/listen/acceptor.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/log/log.h"
#include "server/log/log_budget.h"
#include "server/machine.h"

namespace halflight {
namespace {

// How long to leave clients in the backlog when not even they can be turned away.
constexpr int kPauseMs = 20;
// Connections of one socket before the others, and the order to stop, are looked at.
constexpr int kBatch = 64;
// Descriptors for files, the device, libraries and sockets that are no connections.
constexpr uint64_t kOtherDescriptors = 128;

// After a minute without a word the kernel asks the peer's kernel whether it is still there, and
// closes after another half. HTTP/2 pings would not do: a client that waits does not answer them.
void WatchPeer(int fd) {
  const auto set = [fd](int level, int option, int value) {
    setsockopt(fd, level, option, &value, sizeof(value));  // unix sockets have none of these
  };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 60);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 10);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
  set(IPPROTO_TCP, TCP_NODELAY, 1);
}

// A descriptor that stands for nothing, to be given up when there are no others.
class Reserve {
 public:
  Reserve() { Take(); }
  ~Reserve() { Release(); }
  Reserve(const Reserve&) = delete;
  Reserve& operator=(const Reserve&) = delete;

  bool Take() {
    if (fd_ < 0) {
      fd_ = open("/dev/null", O_RDONLY | O_CLOEXEC);
    }
    return fd_ >= 0;
  }
  void Release() {
    if (fd_ >= 0) {
      close(fd_);
      fd_ = -1;
    }
  }

 private:
  int fd_ = -1;
};

// What goes wrong with every client is told at once, then counted. Any thread.
class Complaint {
 public:
  void Count(const char* why) {
    ++refused_;
    if (const auto count = budget_.Take()) {
      Log(LogLevel::kWarn, "connections_refused", {{"message", why}, {"since_last_told", *count}});
    }
  }
  [[nodiscard]] uint64_t refused() const { return refused_; }

 private:
  std::atomic<uint64_t> refused_ = 0;
  LogBudget budget_{1};
};

}  // namespace

class Acceptor::Loop {
 public:
  Loop(std::vector<ListeningSocket> sockets, Connections& connections,
       const ConnectionLimits& limits, Serve serve)
      : sockets_(std::move(sockets)),
        connections_(connections),
        limits_(limits),
        serve_(std::move(serve)),
        wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  ~Loop() { close(wake_); }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  absl::Status Listen() {
    if (wake_ < 0) {
      return absl::UnavailableError("no descriptor left to start with");
    }
    for (ListeningSocket& socket : sockets_) {
      if (absl::Status status = socket.Listen(); !status.ok()) {
        return status;
      }
    }
    return absl::OkStatus();
  }

  void Run() {
    std::vector<pollfd> polled = {{.fd = wake_, .events = POLLIN, .revents = 0}};
    for (const ListeningSocket& socket : sockets_) {
      polled.push_back({.fd = socket.fd(), .events = POLLIN, .revents = 0});
    }
    bool pause = false;
    while (true) {
      poll(polled.data(), pause ? 1 : polled.size(), pause ? kPauseMs : -1);
      if (polled[0].revents != 0) {
        return;
      }
      const bool look_at_all = std::exchange(pause, false);
      for (size_t i = 1; i < polled.size(); ++i) {
        if (look_at_all || polled[i].revents != 0) {
          pause |= !AcceptAll(polled[i].fd);
        }
      }
    }
  }

  void Stop() {
    const uint64_t one = 1;
    [[maybe_unused]] const auto written = write(wake_, &one, sizeof(one));
  }
  // After Run has returned.
  void Close() { sockets_.clear(); }

  void HangUp() { connections_.HangUp(); }
  void CutOff() { connections_.CutOff(); }

  ConnectionCounts Counts() {
    return {.open = connections_.Count(),
            .accepted = connections_.added(),
            .refused = complaint_.refused()};
  }

 private:
  // False where it is of no use to try again at once.
  bool AcceptAll(int listening) {
    for (int i = 0; i < kBatch; ++i) {
      sockaddr_storage peer{};
      socklen_t length = sizeof(peer);
      auto& address = reinterpret_cast<sockaddr&>(peer);
      const int fd = accept4(listening, &address, &length, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fd >= 0) {
        Take(fd, MachineOf(address));
        continue;
      }
      switch (errno) {
        case EAGAIN:
          return true;
        case EMFILE:
        case ENFILE:
          if (!TurnAway(listening)) {
            return false;
          }
          break;
        case EINTR:
        case ECONNABORTED:  // and what else has befallen that one connection: see accept(2)
        case EPROTO:
        case ENOPROTOOPT:
        case EHOSTDOWN:
        case EHOSTUNREACH:
        case ENETDOWN:
        case ENETUNREACH:
        case ENONET:
        case EOPNOTSUPP:
        case EPERM:
          break;
        default:
          complaint_.Count(std::strerror(errno));
          return false;
      }
    }
    return true;
  }

  void Take(int fd, const std::string& machine) {
    const Connections::Addition addition = connections_.Add(fd, machine, limits_);
    if (addition != Connections::Addition::kDone) {
      close(fd);
      complaint_.Count(addition == Connections::Addition::kFull
                           ? "max_connections are open"
                           : "max_client_connections of one machine are open");
      return;
    }
    WatchPeer(fd);
    serve_(fd);
  }

  // Accepts in place of the reserve, and hangs up. False where others were quicker to take it.
  bool TurnAway(int listening) {
    if (!reserve_.Take()) {
      return false;
    }
    reserve_.Release();
    const int fd = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC);
    const bool gone = fd >= 0 || errno == EAGAIN;
    if (fd >= 0) {
      close(fd);
      complaint_.Count("no descriptors are left");
    }
    return reserve_.Take() && gone;
  }

  std::vector<ListeningSocket> sockets_;
  Connections& connections_;
  const ConnectionLimits limits_;
  const Serve serve_;
  const int wake_;
  Reserve reserve_;
  Complaint complaint_;
};

absl::StatusOr<std::unique_ptr<Acceptor>> Acceptor::Start(std::vector<ListeningSocket> sockets,
                                                          Connections& connections,
                                                          const ConnectionLimits& limits,
                                                          Serve serve) {
  auto loop = std::make_unique<Loop>(std::move(sockets), connections, limits, std::move(serve));
  if (absl::Status status = loop->Listen(); !status.ok()) {
    return status;
  }
  return std::unique_ptr<Acceptor>(new Acceptor(std::move(loop)));  // the constructor is private
}

Acceptor::Acceptor(std::unique_ptr<Loop> loop)
    : loop_(std::move(loop)), thread_([this] { loop_->Run(); }) {}

Acceptor::~Acceptor() { Stop(); }

void Acceptor::Stop() {
  if (thread_.joinable()) {
    loop_->Stop();
    thread_.join();
    loop_->Close();
  }
}

ConnectionCounts Acceptor::counts() const { return loop_->Counts(); }
void Acceptor::HangUp(std::chrono::milliseconds at_most) {
  constexpr std::chrono::milliseconds kLookAgain{1};
  const auto until = std::chrono::steady_clock::now() + at_most;
  Stop();
  loop_->HangUp();
  while (loop_->Counts().open > 0 && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(kLookAgain);
  }
  loop_->CutOff();
}

uint32_t RoomForConnections() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  getrlimit(RLIMIT_NOFILE, &limit);
  const uint64_t room = limit.rlim_cur > kOtherDescriptors ? limit.rlim_cur - kOtherDescriptors : 1;
  return static_cast<uint32_t>(std::min<uint64_t>(room, UINT32_MAX));
}

}  // namespace halflight
