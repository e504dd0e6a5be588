// Pixels as they are: 32-bit little-endian floats without a header.
// No metadata fits in; who asks for this has it from elsewhere.
#pragma once

#include "absl/status/statusor.h"
#include "server/encode/encoder.h"

namespace halflight {

// Layer by layer, row by row from the top, channels interleaved. Copies nothing.
absl::StatusOr<EncodedImage> EncodeRawFloat(const EncodeInput& input);

}  // namespace halflight
