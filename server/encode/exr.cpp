// Describes pixels in OpenEXR's terms, and has the image library write them.
// Leaves compression, and the conversion to half floats, to the library.
#include "server/encode/exr.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/encode/image_file.h"

namespace halflight {
namespace {

// From here on rounding to half gives infinity, which a depth image takes for "nothing there".
constexpr float kBeyondHalf = 65520.0F;

const char* CompressionName(ExrCompression compression) {
  switch (compression) {
    case ExrCompression::kNone:
      return "none";
    case ExrCompression::kRle:
      return "rle";
    case ExrCompression::kZips:
      return "zips";
    case ExrCompression::kZip:
      return "zip";
    case ExrCompression::kPiz:
      return "piz";
    case ExrCompression::kDwaa:
      return "dwaa";
    case ExrCompression::kDwab:
      return "dwab";
  }
  return "zip";
}

// GLM keeps the columns of a matrix that acts on column vectors one after the other; read row by
// row, that is the matrix for row vectors.
MatrixRows RowVectorMatrix(const glm::dmat4& matrix) {
  MatrixRows rows{};
  std::transform(glm::value_ptr(matrix), glm::value_ptr(matrix) + rows.size(), rows.begin(),
                 [](double value) { return static_cast<float>(value); });
  return rows;
}

// Ours come last, so that no text can take their place.
void AddAttributes(const EncodeInput& input, ImageFile& file) {
  const ImageMetadata& metadata = input.metadata;
  const auto add = [&file](const std::string& name, const AttributeValue& value) {
    file.attributes.emplace_back(name, value);
  };
  for (const auto& [name, value] : metadata.text) add(name, Remark{value});
  if (metadata.world_to_camera.has_value()) {
    const glm::dmat4 left_handed = glm::scale(glm::dmat4(1.0), glm::dvec3(1.0, 1.0, -1.0));
    add("worldToCamera", RowVectorMatrix(left_handed * *metadata.world_to_camera));
  }
  if (metadata.world_to_ndc.has_value()) {
    add("worldToNDC", RowVectorMatrix(*metadata.world_to_ndc));
    if (ShowsLight(input.kind)) {
      add("halflight:worldToLightTexture", RowVectorMatrix(*metadata.world_to_ndc));
    }
  }
  // From ITU-R BT.709, whose primaries and white sRGB shares.
  add("chromaticities", Chromaticities{0.64F, 0.33F, 0.30F, 0.60F, 0.15F, 0.06F, 0.3127F, 0.3290F});
  add("oiio:ColorSpace", "Linear");
  add("DateTime", "");
  add("compression", CompressionName(input.settings.compression));
}

absl::StatusOr<EncodedImage> EncodeExr(const EncodeInput& input, SampleType stored) {
  const Image& image = *input.image;
  ImageFile file{.format = "exr",
                 .width = image.width,
                 .height = image.height,
                 .channels = image.channels,
                 .given = SampleType::kFloat,
                 .stored = stored,
                 .associated_alpha = true,
                 .offset = {input.metadata.data_window.x, input.metadata.data_window.y},
                 .display_size = input.metadata.display_size,
                 .attributes = {},
                 .parts = {}};
  AddAttributes(input, file);
  if (image.layers > 1 || input.kind == ImageKind::kLightLayers) {
    for (int layer = 0; layer < image.layers; ++layer) {
      file.parts.push_back(absl::StrFormat("layer.%04d", layer));
    }
  }
  EncodedImage encoded{};
  std::string bytes;
  const absl::Status status = WriteToMemory(file, image.pixels.data(), input.settings.stop, bytes);
  if (!status.ok()) return status;
  encoded.bytes = SharedBytes(std::move(bytes));
  return encoded;
}

}  // namespace

absl::StatusOr<EncodedImage> EncodeExrHalf(const EncodeInput& input) {
  const std::vector<float>& pixels = input.image->pixels;
  const auto too_large = std::find_if(pixels.begin(), pixels.end(), [](float value) {
    return std::isfinite(value) && std::abs(value) >= kBeyondHalf;
  });
  if (too_large != pixels.end()) {
    return absl::InvalidArgumentError(absl::StrCat("format: EXR_HALF cannot hold ", *too_large,
                                                   ", only up to 65504; EXR_FLOAT can"));
  }
  return EncodeExr(input, SampleType::kHalf);
}

absl::StatusOr<EncodedImage> EncodeExrFloat(const EncodeInput& input) {
  return EncodeExr(input, SampleType::kFloat);
}

}  // namespace halflight
