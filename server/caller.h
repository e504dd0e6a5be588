// Who makes a call.
#pragma once

#include <string>
#include <string_view>

namespace halflight {

struct Caller {
  std::string tenant{};   // "" where nothing says who it is
  std::string peer{};     // its address, as gRPC writes it
  std::string call_id{};  // the name that the call is found by in the log

  // By whom shares are counted: the tenant, or the address without its port, since a client has
  // many.
  [[nodiscard]] std::string client() const {
    if (!tenant.empty()) {
      return "tenant:" + tenant;
    }
    const std::string_view address = peer;
    const bool has_port = address.substr(0, 4) == "ipv4" || address.substr(0, 4) == "ipv6";
    return std::string(has_port ? address.substr(0, address.rfind(':')) : address);
  }
};

}  // namespace halflight
