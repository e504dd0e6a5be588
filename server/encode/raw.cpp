// Copies pixels into bytes; see raw.h for what is left out.
#include "server/encode/raw.h"

#include <bit>

namespace halflight {

absl::StatusOr<EncodedImage> EncodeRawFloat(const EncodeInput& input) {
  static_assert(std::endian::native == std::endian::little, "the format is little-endian");
  const std::vector<float>& pixels = input.image.pixels;
  EncodedImage encoded{};
  encoded.bytes.assign(reinterpret_cast<const char*>(pixels.data()), pixels.size() * sizeof(float));
  return encoded;
}

}  // namespace halflight
