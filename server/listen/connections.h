// The connections that are open, counted without a word from whoever owns them, and ended where a
// peer takes nothing any more. Speaks no protocol.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/client_counts.h"
#include "server/patience.h"

namespace halflight {

struct ConnectionLimits {
  size_t all = 0;
  size_t one_machine = 0;  // of them
};

// gRPC takes a socket and says nothing when it closes it. But the kernel gives every socket a
// number of its own (SO_COOKIE), never to be used again: a descriptor under which that number is
// not found any more has been closed, whoever has the descriptor now. Looking costs 0.3 us a
// connection and no descriptor; what it cannot tell is when a connection ended, only that it did by
// the time somebody looks. Any thread.
class Connections {
 public:
  enum class Addition : uint8_t { kDone, kMachineFull, kFull };
  // A socket that is handed on, of a peer on this machine (machine.h); nothing is kept of it where
  // as many are open as may be. Looks at the sockets only when as many were added and not seen to
  // be closed, and then every few milliseconds at most, so that a crowd at the door costs no more
  // than its accepting.
  Addition Add(int fd, const std::string& machine, const ConnectionLimits& limits);

  // Open ones: looks at each.
  size_t Count();
  // All that were ever added.
  [[nodiscard]] uint64_t added() const;

  // Nothing more is received over those that are open: who serves them finds that their peers are
  // gone, and closes them.
  void HangUp();
  // Nothing more is sent either: what waits for peers that take nothing is let go of.
  void CutOff();

  // Of those whose peers leave unread what was sent to them, or take too little while more waits,
  // until there is no patience left, as far as looks tell: to be called again and again, `apart`
  // from one another. What was seen before a longer pause does not count.
  //
  // gRPC 1.51 cancels no call while it writes to the call's socket, and so not at all where that is
  // full and the peer's kernel alone answers for it: a process that was stopped, or one that reads
  // nothing. Only when the socket ends do the calls. (Can go when gRPC fails what waits behind a
  // write without waiting for the write.)
  void CutOffStalled(const PatienceLimits& limits, std::chrono::milliseconds apart);

 private:
  using Clock = std::chrono::steady_clock;
  // In bytes: what is left unread, or is on its way; whether more waits than the peer has room for;
  // and how much it has ever taken. Of a unix socket the kernel does not count that, and any change
  // of what is left stands for it.
  struct Backlog {
    int unread = 0;
    bool full = false;
    std::optional<uint64_t> taken;
  };
  struct Connection {
    uint64_t cookie = 0;
    std::string machine{};
    Backlog backlog{};  // when it was last looked at
    std::optional<Patience> patience;
  };

  static Backlog BacklogOf(int fd);
  void ShutDown(int how);
  // Under the mutex.
  [[nodiscard]] Addition RoomFor(const std::string& machine, const ConnectionLimits& limits) const;
  void Forget(int fd);
  void ForgetClosed();

  mutable std::mutex mutex_;
  std::unordered_map<int, Connection> open_;  // by descriptor
  ClientCounts machines_;                     // of those
  uint64_t added_ = 0;
  Clock::time_point looked_;
  Clock::time_point looked_for_stalled_;
};

}  // namespace halflight
