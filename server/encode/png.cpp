// Scales and rounds pixels to integers, and has the image library pack them as PNG.
// Leaves filtering and deflating to the library.
#include "server/encode/png.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/encode/image_file.h"
#include "server/encode/srgb.h"

namespace halflight {
namespace {

// libpng's default limit on height, for writers and for most readers.
constexpr int64_t kMostRows = 1'000'000;

// Level 1 takes a third of the time of the library's default, 6, for files a third larger; the "up"
// filter alone is faster than letting libpng try all filters a row, and as small on smoke.
constexpr int kCompressionLevel = 1;
constexpr int kUpFilter = 0x20;  // PNG_FILTER_UP

// Rounds to nearest; anything outside [0, 1] is clamped, and what is not a number gives 0.
template <typename Integer>
Integer Quantize(float value) {
  constexpr auto kLargest = static_cast<float>(std::numeric_limits<Integer>::max());
  if (!(value > 0.0F)) return 0;
  const float nearest = std::min(value, 1.0F) * kLargest + 0.5F;
  return static_cast<Integer>(nearest);
}

// What is drawn as white and black; equal where all values are.
struct Range {
  double white;
  double black;
};

std::optional<Range> FindRange(const EncodeInput& input) {
  const bool depth = input.kind == ImageKind::kDepth;
  const bool error = input.kind == ImageKind::kError;
  if (!depth && !error &&
      !(ShowsLight(input.kind) && input.quantity == LightQuantity::kOpticalDepth)) {
    return std::nullopt;
  }
  float smallest = std::numeric_limits<float>::infinity();
  float largest = -smallest;
  for (const float value : input.image->pixels) {
    if (!std::isfinite(value)) continue;
    smallest = std::min(smallest, value);
    largest = std::max(largest, value);
  }
  if (smallest > largest) return std::nullopt;  // no finite value: there is nothing to scale
  if (error) return Range{std::max(std::abs(smallest), std::abs(largest)), 0.0};
  return depth ? Range{smallest, largest} : Range{std::max(largest, 0.0F), 0.0};
}

template <typename Integer>
std::vector<Integer> QuantizeBeauty(const std::vector<float>& pixels) {
  const SrgbCurve& curve = SrgbCurve::Get();
  std::vector<Integer> codes(pixels.size());
  for (size_t i = 0; i + 3 < pixels.size(); i += 4) {
    const float alpha = pixels[i + 3];
    if (!(alpha > 0.0F)) continue;  // codes are 0 already
    const float scale = 1.0F / alpha;
    for (size_t channel = 0; channel < 3; ++channel) {
      codes[i + channel] = Quantize<Integer>(curve(pixels[i + channel] * scale));
    }
    codes[i + 3] = Quantize<Integer>(alpha);
  }
  return codes;
}

template <typename Integer>
std::vector<Integer> QuantizeLinear(const EncodeInput& input, const std::optional<Range>& range) {
  const std::vector<float>& pixels = input.image->pixels;
  std::vector<Integer> codes(pixels.size());
  if (!range.has_value()) {
    const bool nothing_seen = input.kind == ImageKind::kDepth;
    if (!nothing_seen)
      std::transform(pixels.begin(), pixels.end(), codes.begin(), Quantize<Integer>);
    return codes;
  }
  const double span = range->white - range->black;
  std::transform(pixels.begin(), pixels.end(), codes.begin(), [&](float value) -> Integer {
    if (input.kind == ImageKind::kError) value = std::abs(value);
    if (!std::isfinite(value)) {
      const bool beyond_white = input.kind != ImageKind::kDepth && value > 0.0F;
      return beyond_white ? std::numeric_limits<Integer>::max() : Integer{0};
    }
    // A single depth is all nearest: white. A single optical depth or error is 0: black.
    if (span == 0.0) return Quantize<Integer>(input.kind == ImageKind::kDepth ? 1.0F : 0.0F);
    return Quantize<Integer>(static_cast<float>((value - range->black) / span));
  });
  return codes;
}

template <typename Integer>
absl::StatusOr<EncodedImage> EncodePng(const EncodeInput& input) {
  const Image& image = *input.image;
  const int64_t rows = static_cast<int64_t>(image.height) * image.layers;
  if (rows > kMostRows) {
    return absl::InvalidArgumentError(
        absl::StrCat("format: PNG stacks the layers, here ", image.layers, " of ", image.height,
                     " rows; it holds ", kMostRows, " rows at most; EXR holds more"));
  }
  const bool beauty = input.kind == ImageKind::kBeauty;
  constexpr SampleType kType =
      std::is_same_v<Integer, uint8_t> ? SampleType::kUint8 : SampleType::kUint16;
  ImageFile file{.format = "png",
                 .width = image.width,
                 .height = static_cast<int>(rows),
                 .channels = image.channels,
                 .given = kType,
                 .stored = kType,
                 .associated_alpha = false,
                 .offset = {},
                 .display_size = {},
                 .attributes = {},
                 .parts = {}};
  for (const auto& [name, value] : input.metadata.text) {
    file.attributes.emplace_back(name, Remark{value});
  }
  file.attributes.emplace_back("oiio:ColorSpace", beauty ? "sRGB" : "Linear");
  file.attributes.emplace_back("png:compressionLevel", kCompressionLevel);
  file.attributes.emplace_back("png:filter", kUpFilter);

  EncodedImage encoded{};
  const std::optional<Range> range = FindRange(input);
  if (range.has_value()) {
    encoded.white_black = {range->white, range->black};
    file.attributes.emplace_back("halflight:white_value",
                                 Remark{absl::StrFormat("%.9g", range->white)});
    file.attributes.emplace_back("halflight:black_value",
                                 Remark{absl::StrFormat("%.9g", range->black)});
  }
  const std::vector<Integer> codes =
      beauty ? QuantizeBeauty<Integer>(image.pixels) : QuantizeLinear<Integer>(input, range);
  std::string bytes;
  const absl::Status status = WriteToMemory(file, codes.data(), input.settings.stop, bytes);
  if (!status.ok()) return status;
  encoded.bytes = SharedBytes(std::move(bytes));
  return encoded;
}

}  // namespace

absl::StatusOr<EncodedImage> EncodePng8(const EncodeInput& input) {
  return EncodePng<uint8_t>(input);
}

absl::StatusOr<EncodedImage> EncodePng16(const EncodeInput& input) {
  return EncodePng<uint16_t>(input);
}

}  // namespace halflight
