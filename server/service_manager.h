// What systemd and its likes agree on with a service: sockets handed over at its start, and a word
// when it is ready. Twenty lines each, for which no library is linked.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "server/listen/listening_socket.h"

namespace halflight {

// The sockets that were handed over (LISTEN_FDS, where LISTEN_PID is this process); none where
// nobody did. Forgets them: neither a second call nor a child sees them. InvalidArgument where one
// does not listen. Call it before there are other threads.
absl::StatusOr<std::vector<ListeningSocket>> TakeInheritedSockets();

// How often it wants to hear "WATCHDOG=1" at least (WATCHDOG_USEC, where WATCHDOG_PID is this
// process or unset); none where it does not.
std::optional<std::chrono::microseconds> WatchdogInterval();

// Says "READY=1", "STOPPING=1" and the like where anybody listens (NOTIFY_SOCKET).
void NotifyServiceManager(const char* state);

}  // namespace halflight
