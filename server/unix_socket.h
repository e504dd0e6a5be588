// Files of unix sockets: left over from a server that died, or still in use. Does not listen.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace halflight {

// The path of an address "unix:path"; empty for others.
std::string SocketPath(const std::string& address);

// Removes the socket file that a dead server left at `path`. AlreadyExists where a server listens
// there or something other than a socket is there.
absl::Status RemoveStaleSocket(const std::string& path);

}  // namespace halflight
