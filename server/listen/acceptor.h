// The loop that accepts connections and hands them on. gRPC 1.51 gives its own listener up for good
// the first time that descriptors run out; this one turns those away that it has no room for, and
// goes on; at the end it hangs up. Speaks no protocol.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "server/listen/connections.h"
#include "server/listen/listening_socket.h"

namespace halflight {

struct ConnectionCounts {
  uint64_t open = 0;
  uint64_t accepted = 0;  // all that were ever handed on
  uint64_t refused = 0;   // all that were turned away
};

class Acceptor {
 public:
  // Takes over a connected socket that does not block; the acceptor's thread.
  using Serve = std::function<void(int fd)>;

  // Listens on all sockets. With so many connections open, or without a descriptor left, a client
  // that connects is disconnected at once, which gRPC reports as UNAVAILABLE: it can try elsewhere
  // or later. Left waiting it would seem to be connected, and hang until its deadline. Unavailable
  // where a socket cannot listen. `connections` outlive the acceptor.
  static absl::StatusOr<std::unique_ptr<Acceptor>> Start(std::vector<ListeningSocket> sockets,
                                                         Connections& connections,
                                                         const ConnectionLimits& limits,
                                                         Serve serve);
  // Stops.
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  // Closes the sockets: nobody can connect any more, but those connected stay. When it has
  // returned `serve` is not called again.
  void Stop();

  // Looks at every connection. Any thread.
  [[nodiscard]] ConnectionCounts counts() const;

  // Stops, receives nothing more from those connected, and waits until whoever serves them has
  // closed their connections, at most that long: a peer finds its connection lost. Those that are
  // left then are cut off.
  void HangUp(std::chrono::milliseconds at_most);

 private:
  class Loop;
  explicit Acceptor(std::unique_ptr<Loop> loop);

  std::unique_ptr<Loop> loop_;
  std::thread thread_;
};

// Raises the process's limit on descriptors as far as it may go, and says how many connections fit
// under it: the rest is for files, the device and the server itself.
uint32_t RoomForConnections();

}  // namespace halflight
