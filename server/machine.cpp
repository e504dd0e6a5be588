#include "server/machine.h"

#include <algorithm>
#include <array>
#include <cstring>

#include <arpa/inet.h>
#include <netinet/in.h>

#include <fmt/format.h>

namespace halflight {
namespace {

constexpr const char* kThisMachine = "this machine";

std::string OfIpv4(const in_addr& address) {
  constexpr uint32_t kLoopback = 127;
  if (ntohl(address.s_addr) >> 24U == kLoopback) {
    return kThisMachine;
  }
  std::array<char, INET_ADDRSTRLEN> text{};
  return inet_ntop(AF_INET, &address, text.data(), text.size());
}

std::string OfIpv6(const in6_addr& address) {
  if (IN6_IS_ADDR_LOOPBACK(&address)) {
    return kThisMachine;
  }
  if (IN6_IS_ADDR_V4MAPPED(&address)) {
    in_addr mapped{};
    std::memcpy(&mapped, address.s6_addr + 12, sizeof(mapped));
    return OfIpv4(mapped);
  }
  constexpr size_t kNetworkBytes = 8;
  in6_addr network = address;
  std::fill(network.s6_addr + kNetworkBytes, std::end(network.s6_addr), uint8_t{0});
  std::array<char, INET6_ADDRSTRLEN> text{};
  return fmt::format("{}/64", inet_ntop(AF_INET6, &network, text.data(), text.size()));
}

// "host:port", where brackets round the host may be escaped, and the host may name an interface.
std::string HostOf(std::string_view place) {
  std::string host(place.substr(0, place.rfind(':')));
  for (const char* bracket : {"[", "]", "%5B", "%5D"}) {
    if (const size_t at = host.find(bracket); at != std::string::npos) {
      host.erase(at, std::strlen(bracket));
    }
  }
  return host.substr(0, host.find('%'));
}

}  // namespace

std::string MachineOf(const sockaddr& peer) {
  switch (peer.sa_family) {
    case AF_INET:
      return OfIpv4(reinterpret_cast<const sockaddr_in&>(peer).sin_addr);
    case AF_INET6:
      return OfIpv6(reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr);
    default:
      return kThisMachine;
  }
}

std::string MachineOf(std::string_view peer) {
  constexpr size_t kScheme = 5;
  const std::string_view scheme = peer.substr(0, kScheme);
  if (scheme == "ipv4:") {
    in_addr address{};
    const std::string host = HostOf(peer.substr(kScheme));
    return inet_pton(AF_INET, host.c_str(), &address) == 1 ? OfIpv4(address) : host;
  }
  if (scheme == "ipv6:") {
    in6_addr address{};
    const std::string host = HostOf(peer.substr(kScheme));
    return inet_pton(AF_INET6, host.c_str(), &address) == 1 ? OfIpv6(address) : host;
  }
  return kThisMachine;
}

}  // namespace halflight
