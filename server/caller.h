// Who asks: worked out once when a call begins (access/access.h), then carried along for logs,
// fair shares and figures.
#pragma once

#include <string>

namespace halflight {

struct Caller {
  std::string tenant;  // empty where the server asks for no authentication
  std::string peer;    // as gRPC writes it: "ipv4:127.0.0.1:40000", "unix:"
};

}  // namespace halflight
