// PNG with 8 or 16 bits a channel.
// Leaves out matrices, and the place of a crop in the whole image: PNG has no fields for them.
#pragma once

#include "absl/status/statusor.h"
#include "server/encode/encoder.h"

namespace halflight {

// Beauty: sRGB with unassociated alpha. Everything else: linear grey or RGB, clamped to [0, 1];
// depth scaled so that the nearest is white and the farthest black, infinity black too; optical
// depth scaled so that 0 is black and the largest of all layers is white; errors without their
// sign, scaled so that 0 is black and the largest is white. The range is returned, where anything
// was scaled, and stands in the text "halflight:white_value" and "halflight:black_value" too.
// Layers lie one below the other. Text is written as it is given, while PNG readers take it for
// Latin-1.
absl::StatusOr<EncodedImage> EncodePng8(const EncodeInput& input);
absl::StatusOr<EncodedImage> EncodePng16(const EncodeInput& input);

}  // namespace halflight
