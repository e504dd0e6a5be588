// Which machine is at the other end of a connection: by that shares are counted of clients that do
// not say who they are.
#pragma once

#include <string>
#include <string_view>

#include <sys/socket.h>

namespace halflight {

// Its address, but for what somebody there can choose at will: names of unix sockets and addresses
// of loopback are all "this machine", and of an IPv6 address the network counts, its first 64 bits
// (RFC 4291, section 2.5.4). An IPv4 address that is mapped to IPv6 is that address.
std::string MachineOf(const sockaddr& peer);

// The same of a peer as gRPC 1.51 writes it: "ipv4:host:port", "ipv6:%5Bhost%5D:port", "unix:path".
std::string MachineOf(std::string_view peer);

}  // namespace halflight
