// The table of formats, and the checks that all of them share.
// How pixels become bytes is in one pair of files for each family of formats.
#include "server/encode/encode.h"

#include <algorithm>
#include <array>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/encode/encoder.h"
#include "server/encode/exr.h"
#include "server/encode/png.h"
#include "server/encode/raw.h"

namespace halflight {
namespace {

struct FormatRow {
  ImageFormat format;
  const char* media_type;
  absl::StatusOr<EncodedImage> (*encode)(const EncodeInput& input);
};

constexpr std::array kFormats{
    FormatRow{ImageFormat::kPng8, "image/png", EncodePng8},
    FormatRow{ImageFormat::kPng16, "image/png", EncodePng16},
    FormatRow{ImageFormat::kExrHalf, "image/x-exr", EncodeExrHalf},
    FormatRow{ImageFormat::kExrFloat, "image/x-exr", EncodeExrFloat},
    FormatRow{ImageFormat::kRawFloat, "application/octet-stream", EncodeRawFloat},
};

absl::Status CheckChannels(const std::vector<std::string>& channels, ImageKind kind) {
  using Channels = std::vector<std::string>;
  std::vector<Channels> allowed;
  switch (kind) {
    case ImageKind::kBeauty:
      allowed = {{"R", "G", "B", "A"}};
      break;
    case ImageKind::kCoverage:
      allowed = {{"A"}};
      break;
    case ImageKind::kDepth:
      allowed = {{"Z"}};
      break;
    case ImageKind::kLightTransmittance:
    case ImageKind::kLightBuffer:
    case ImageKind::kLightLayers:
      allowed = {{"Y"}, {"R", "G", "B"}};
      break;
    case ImageKind::kError:
      allowed = {{"R", "G", "B"}};
      break;
  }
  if (std::find(allowed.begin(), allowed.end(), channels) != allowed.end()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("image.channels: ", absl::StrJoin(channels, ","), "; allowed for this kind: ",
                   absl::StrJoin(allowed, " or ", [](std::string* out, const Channels& names) {
                     absl::StrAppend(out, absl::StrJoin(names, ","));
                   })));
}

absl::Status CheckSizes(const Image& image, const ImageMetadata& metadata) {
  if (image.width < 1 || image.height < 1 || image.layers < 1) {
    return absl::InvalidArgumentError(absl::StrCat("image: ", image.width, " x ", image.height,
                                                   " pixels, ", image.layers,
                                                   " layers; each must be at least 1"));
  }
  const size_t expected = static_cast<size_t>(image.width) * static_cast<size_t>(image.height) *
                          static_cast<size_t>(image.layers) * image.channels.size();
  if (image.pixels.size() != expected) {
    return absl::InvalidArgumentError(absl::StrCat("image.pixels: ", image.pixels.size(),
                                                   " values; its size calls for ", expected));
  }
  if (metadata.display_size == glm::ivec2(0)) return absl::OkStatus();
  const PixelRect& window = metadata.data_window;
  const bool inside = window.x >= 0 && window.y >= 0 &&
                      metadata.display_size.x - window.x >= window.width &&
                      metadata.display_size.y - window.y >= window.height;
  if (window.width != image.width || window.height != image.height || !inside) {
    return absl::InvalidArgumentError(
        absl::StrCat("metadata.data_window: ", window.width, " x ", window.height, " at (",
                     window.x, ", ", window.y, "); must have the image's size, ", image.width,
                     " x ", image.height, ", and lie within the whole image, ",
                     metadata.display_size.x, " x ", metadata.display_size.y));
  }
  return absl::OkStatus();
}

absl::Status CheckText(const ImageMetadata& metadata) {
  constexpr size_t kLongestName = 79;  // of a PNG keyword
  for (const auto& [name, value] : metadata.text) {
    const bool printable =
        std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c <= '~'; });
    if (name.empty() || name.size() > kLongestName || !printable) {
      return absl::InvalidArgumentError(
          absl::StrCat("metadata.text: name \"", name,
                       "\"; allowed: 1 to 79 printable ASCII characters without spaces"));
    }
    if (value.find('\0') != std::string::npos) {
      return absl::InvalidArgumentError(
          absl::StrCat("metadata.text: the value of ", name, " holds a zero byte"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<EncodedImage> EncodeImage(const SharedImage& image, ImageKind kind,
                                         LightQuantity quantity, const EncodeSettings& settings,
                                         const ImageMetadata& metadata) {
  if (absl::Status status = CheckChannels(image->channels, kind); !status.ok()) return status;
  if (absl::Status status = CheckSizes(*image, metadata); !status.ok()) return status;
  if (absl::Status status = CheckText(metadata); !status.ok()) return status;
  const auto* const row =
      std::find_if(kFormats.begin(), kFormats.end(),
                   [&](const FormatRow& candidate) { return candidate.format == settings.format; });
  if (row == kFormats.end()) {
    return absl::InvalidArgumentError(
        absl::StrCat("settings.format: ", static_cast<int>(settings.format), "; not a format"));
  }
  absl::StatusOr<EncodedImage> encoded = row->encode({image, kind, quantity, settings, metadata});
  if (encoded.ok()) encoded->media_type = row->media_type;
  return encoded;
}

}  // namespace halflight
