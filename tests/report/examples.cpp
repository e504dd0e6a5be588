#include "tests/report/examples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/encode/image_file.h"
#include "server/encode/srgb.h"
#include "tests/measure/frame_error.h"
#include "tests/report/error_map.h"

namespace halflight::report {
namespace {

using Rgb = std::array<uint8_t, 3>;

const float* PixelOf(const Image& image, const glm::ivec2& place) {
  return &image.pixels[4 * (static_cast<size_t>(place.y) * static_cast<size_t>(image.width) +
                            static_cast<size_t>(place.x))];
}

// The rectangle of all covered pixels.
PixelRect BoundsOf(const std::vector<glm::ivec2>& pixels) {
  glm::ivec2 low = pixels.front();
  glm::ivec2 high = low;
  for (const glm::ivec2& pixel : pixels) {
    low = glm::min(low, pixel);
    high = glm::max(high, pixel);
  }
  return {low.x, low.y, high.x - low.x + 1, high.y - low.y + 1};
}

Rgb OnDarkGround(const glm::vec4& premultiplied) {
  constexpr glm::vec3 kGround(0.02F, 0.025F, 0.035F);
  const glm::vec3 linear = glm::vec3(premultiplied) + (1.0F - premultiplied.a) * kGround;
  Rgb codes{};
  for (int c = 0; c < 3; ++c) {
    codes[static_cast<size_t>(c)] =
        static_cast<uint8_t>(std::lround(255.0F * SrgbCurve::Get()(linear[c])));
  }
  return codes;
}

absl::StatusOr<std::string> EncodeRgb(const PixelRect& size, const std::vector<Rgb>& pixels) {
  ImageFile file;
  file.format = "png";
  file.width = size.width;
  file.height = size.height;
  file.channels = {"R", "G", "B"};
  file.given = SampleType::kUint8;
  file.stored = SampleType::kUint8;
  file.attributes = {{"oiio:ColorSpace", "sRGB"}, {"png:compressionLevel", 9}};
  std::string bytes;
  const absl::Status status = WriteToMemory(file, pixels.data(), {}, bytes);
  if (!status.ok()) return status;
  return bytes;
}

// Calls `color` for every pixel of the rectangle, row by row.
template <typename ColorOf>
absl::StatusOr<std::string> Paint(const PixelRect& bounds, const ColorOf& color) {
  std::vector<Rgb> pixels;
  for (int y = bounds.y; y < bounds.y + bounds.height; ++y) {
    for (int x = bounds.x; x < bounds.x + bounds.width; ++x) pixels.push_back(color({x, y}));
  }
  return EncodeRgb(bounds, pixels);
}

// The covered pixels of a reference as an image, the others black.
Image ImageOf(const measure::CoveredReference& reference) {
  Image image{reference.pixels.width, reference.pixels.height, 1, {"R", "G", "B", "A"}, {}};
  image.pixels.resize(4 * static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
  for (size_t i = 0; i < reference.pixels.pixels.size(); ++i) {
    const glm::ivec2& place = reference.pixels.pixels[i];
    const size_t first = 4 * (static_cast<size_t>(place.y) * static_cast<size_t>(image.width) +
                              static_cast<size_t>(place.x));
    for (int c = 0; c < 4; ++c) {
      image.pixels[first + static_cast<size_t>(c)] =
          static_cast<float>(reference.pixels.rgba[i][c]);
    }
  }
  return image;
}

absl::StatusOr<Example> DrawExample(FrameRenderer& renderer, const Results& results, size_t scene,
                                    const std::vector<size_t>& settings) {
  const ReportScene& of = results.scenes[scene];
  const measure::CoveredReference reference = measure::EvaluateCovered(of.scene);
  const Image exact = ImageOf(reference);
  const PixelRect bounds = BoundsOf(reference.pixels.pixels);
  const auto paint_image = [&](const Image& image) {
    return Paint(bounds, [&](const glm::ivec2& place) {
      const float* rgba = PixelOf(image, place);
      return OnDarkGround({rgba[0], rgba[1], rgba[2], rgba[3]});
    });
  };
  absl::StatusOr<std::string> png = paint_image(exact);
  if (!png.ok()) return png.status();
  Example example{scene, {absl::StrCat(of.name, "-exact.png"), *std::move(png)}, {}, {}};
  for (size_t i = 0; i < settings.size(); ++i) {
    const absl::StatusOr<FrameResult> frame = renderer.Render(
        {Apply(results.settings[settings[i]], of.scene), {{ImageKind::kBeauty}}}, {});
    if (!frame.ok()) return frame.status();
    const Image& beauty = frame->images.at(0);
    png = paint_image(beauty);
    if (!png.ok()) return png.status();
    const std::string stem = absl::StrCat(of.name, "-", i == 0 ? "baseline" : "advised");
    example.frames.push_back({absl::StrCat(stem, ".png"), *std::move(png)});
    png = Paint(bounds, [&](const glm::ivec2& place) {
      const float* a = PixelOf(beauty, place);
      const float* b = PixelOf(exact, place);
      return ErrorColor((a[0] + a[1] + a[2] - b[0] - b[1] - b[2]) / 3.0 / reference.mean);
    });
    if (!png.ok()) return png.status();
    example.error_maps.push_back({absl::StrCat(stem, "-error.png"), *std::move(png)});
  }
  return example;
}

}  // namespace

absl::StatusOr<std::vector<Example>> DrawExamples(FrameRenderer& renderer, const Results& results,
                                                  const std::vector<size_t>& settings) {
  std::vector<Example> examples;
  for (size_t scene = 0; scene < results.scenes.size(); ++scene) {
    const ReportScene& of = results.scenes[scene];
    if (of.part != Part::kMatrix || of.plume != "0040" || of.opacity != "dense") continue;
    absl::StatusOr<Example> example = DrawExample(renderer, results, scene, settings);
    if (!example.ok()) return example.status();
    examples.push_back(*std::move(example));
  }
  return examples;
}

}  // namespace halflight::report
