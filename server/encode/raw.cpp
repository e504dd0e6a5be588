// Hands the pixels on as bytes; see raw.h for what is left out.
#include "server/encode/raw.h"

#include <bit>
#include <string_view>

namespace halflight {

absl::StatusOr<EncodedImage> EncodeRawFloat(const EncodeInput& input) {
  static_assert(std::endian::native == std::endian::little, "the format is little-endian");
  const std::vector<float>& pixels = input.image->pixels;
  const std::string_view bytes(reinterpret_cast<const char*>(pixels.data()),
                               pixels.size() * sizeof(float));
  EncodedImage encoded{};
  encoded.bytes = SharedBytes(input.image, bytes);
  return encoded;
}

}  // namespace halflight
