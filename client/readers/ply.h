// Reads particles from PLY: ascii and both binary encodings.
// Takes the element "vertex" and skips the rest, lists included.
#pragma once

#include <string_view>

#include "absl/status/statusor.h"
#include "client/readers/columns.h"

namespace halflight::client {

// Properties may be of any scalar type and in any order; names are those of MatchColumns. Colours
// and emissions of an integer type are taken as sRGB with the type's largest value as 1 (255 for 32
// bits, which hold 8-bit values where they occur) and made linear; integer opacities likewise, but
// already linear. Floating-point ones are linear as they are.
absl::StatusOr<Columns> ReadPly(std::string_view bytes);

}  // namespace halflight::client
