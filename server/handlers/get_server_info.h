// GetServerInfo: what this server is and what it takes.
#pragma once

#include "halflight/v1/service.pb.h"
#include "server/handlers/backend.h"

namespace halflight {

v1::GetServerInfoResponse GetServerInfo(const Backend& backend);

}  // namespace halflight
