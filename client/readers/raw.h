// Reads particles from raw float4: x y z radius, 32-bit little-endian, 16 bytes a particle.
// There is nothing in such a file to recognise it by, so it is read only where it is asked for.
#pragma once

#include <string_view>

#include "absl/status/statusor.h"
#include "client/readers/columns.h"

namespace halflight::client {

absl::StatusOr<Columns> ReadRaw(std::string_view bytes);

}  // namespace halflight::client
