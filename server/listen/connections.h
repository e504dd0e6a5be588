// The connections that are open, counted without a word from whoever owns them. Closes nothing.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

namespace halflight {

// gRPC takes a socket and says nothing when it closes it. But the kernel gives every socket a
// number of its own (SO_COOKIE), never to be used again: a descriptor under which that number is
// not found any more has been closed, whoever has the descriptor now. Looking costs 0.3 us a
// connection and no descriptor; what it cannot tell is when a connection ended, only that it did by
// the time somebody looks. One thread.
class Connections {
 public:
  // A socket that is handed on.
  void Add(int fd);

  // Whether `limit` connections or more are open. Looks at the sockets only when as many were added
  // and not seen to be closed, and then every few milliseconds at most, so that a crowd at the door
  // costs no more than its accepting.
  bool AtLeast(size_t limit);

  // Looks at each.
  size_t Count();

  // Nothing more is received over those that are open: who serves them finds that their peers are
  // gone, and closes them.
  void HangUp();

 private:
  std::unordered_map<int, uint64_t> cookies_;  // by descriptor
  std::chrono::steady_clock::time_point looked_;
};

}  // namespace halflight
