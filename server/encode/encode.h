// Turns rendered pixels into the bytes of an image file, in memory.
// Knows no request and no transport: which format is wanted, and what becomes of the bytes, is the
// caller's business.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>

#include "absl/status/statusor.h"
#include "renderer/image.h"
#include "renderer/scene.h"
#include "server/encode/shared_bytes.h"

namespace halflight {

enum class ImageFormat : uint8_t { kPng8, kPng16, kExrHalf, kExrFloat, kRawFloat };
enum class ExrCompression : uint8_t { kNone, kRle, kZips, kZip, kPiz, kDwaa, kDwab };

struct EncodeSettings {
  ImageFormat format;
  ExrCompression compression = ExrCompression::kZip;  // only EXR reads it
  std::stop_token stop{};                             // when nobody wants the file any more
};

// What a file says about its pixels. Matrices act on column vectors; camera space is x right, y up,
// looking along -z. Files get them in their own format's conventions.
struct ImageMetadata {
  std::optional<glm::dmat4> world_to_camera;  // of the eye, or of the light for light buffers
  // (0,0) top left, (1,1) bottom right of the whole image; for light buffers: light texture from
  // world.
  std::optional<glm::dmat4> world_to_ndc;
  // Of a crop: where the pixels lie in the whole image. Display size 0: the image itself.
  PixelRect data_window;
  glm::ivec2 display_size{0};
  // Names, such as "halflight:technique", are 1 to 79 printable ASCII characters, as PNG asks.
  std::vector<std::pair<std::string, std::string>> text;
};

struct EncodedImage {
  SharedBytes bytes;
  const char* media_type;
  // The values drawn as white and as black, where the format needed the pixels scaled.
  std::optional<std::pair<double, double>> white_black;
};

// Raw floats are the image's own pixels, which the bytes then keep alive instead of copying them.
using SharedImage = std::shared_ptr<const Image>;

// The same arguments give the same bytes. `quantity` matters to light buffers only. InvalidArgument
// where the image is not what its kind says (channels, sizes), or holds what the format cannot:
// finite values beyond half floats in kExrHalf, more than a million rows in PNG. Internal where
// the image library fails, Cancelled soon after the stop was requested. Any thread.
//
// PNG loses, knowingly: what is below 0 or above 1, the sign of errors, and emission where alpha is
// 0, since colours are stored unassociated.
absl::StatusOr<EncodedImage> EncodeImage(const SharedImage& image, ImageKind kind,
                                         LightQuantity quantity, const EncodeSettings& settings,
                                         const ImageMetadata& metadata);

}  // namespace halflight
