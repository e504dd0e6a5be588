// OpenEXR with half or 32-bit floats.
// Leaves out tiles, mip levels and deep data.
#pragma once

#include "absl/status/statusor.h"
#include "server/encode/encoder.h"

namespace halflight {

// Scene-linear with associated alpha; channels are named as the image names them. Layers are parts
// named layer.0000 and so on. Attributes, beside the given text:
//   worldToCamera, worldToNDC  M44f, in the conventions of OpenEXR's ImfStandardAttributes.h: row
//       vectors are multiplied from the left, and camera space is left-handed, looking along +z.
//   halflight:worldToLightTexture  M44f, of light buffers: the same matrix as worldToNDC, so that
//       a tool need not guess. [x y z 1] M divided by w: (0, 0) is the top left corner.
//   chromaticities  of sRGB's primaries and white, D65.
//   capDate  empty: left alone, the library would make two equal frames differ.
// DWAA and DWAB apply to RGB and RGBA; the library writes single channels with ZIP instead, so that
// coverage, depth and grey light stay exact.
// The matrices are 32-bit, as the standard has it: far from the world's origin, take the 64-bit
// ones that come with the frame.
absl::StatusOr<EncodedImage> EncodeExrHalf(const EncodeInput& input);
absl::StatusOr<EncodedImage> EncodeExrFloat(const EncodeInput& input);

}  // namespace halflight
