// Who makes a call.
#pragma once

#include <string>

#include "server/machine.h"

namespace halflight {

struct Caller {
  std::string tenant{};   // "" where nothing says who it is
  std::string peer{};     // its address, as gRPC writes it
  std::string call_id{};  // the name that the call is found by in the log

  // By whom shares are counted: the tenant, or the machine, of which a client has many ports.
  [[nodiscard]] std::string client() const {
    if (!tenant.empty()) {
      return "tenant:" + tenant;
    }
    return MachineOf(peer);
  }
};

}  // namespace halflight
