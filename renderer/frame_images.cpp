#include "renderer/frame_images.h"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "renderer/parallel.h"
#include "renderer/pixel_memory.h"

namespace halflight {

namespace {

size_t PixelCount(const Image& image) {
  return static_cast<size_t>(image.width) * static_cast<size_t>(image.height) *
         static_cast<size_t>(image.layers);
}

// An image of the same size whose pixel is `value(source pixel, target pixel)` with pointers to the
// channels.
template <typename Value>
Image MapPixels(const Image& source, std::vector<std::string> channels, const Value& value) {
  Image image{source.width, source.height, source.layers, std::move(channels), {}};
  const size_t pixels = PixelCount(source);
  const size_t from = source.channels.size();
  const size_t to = image.channels.size();
  image.pixels = Zeros(pixels * to);
  ParallelRanges(pixels, [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end; ++i) {
      value(&source.pixels[i * from], &image.pixels[i * to]);
    }
  });
  return image;
}

std::vector<std::string> ValueChannels(bool colored) {
  return colored ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"Y"};
}

}  // namespace

Image CoverageOf(const Image& image) {
  return MapPixels(image, {"A"}, [](const float* rgba, float* a) { *a = rgba[3]; });
}

Image DepthOf(const Image& target) {
  return MapPixels(target, {"Z"}, [](const float* rgba, float* z) {
    *z = rgba[3] > 0.0F ? rgba[0] / rgba[3] : std::numeric_limits<float>::infinity();
  });
}

Image TransmittanceOf(const Image& target, bool colored) {
  const size_t channels = colored ? 3 : 1;
  return MapPixels(target, ValueChannels(colored), [channels](const float* rgba, float* value) {
    for (size_t c = 0; c < channels; ++c) value[c] = rgba[3] > 0.0F ? rgba[c] / rgba[3] : 1.0F;
  });
}

Image LightImage(const Image& optical_depth, LightQuantity quantity, const Light& light) {
  if (quantity == LightQuantity::kOpticalDepth) return optical_depth;
  const bool colored = light.colored_density();
  const size_t channels = colored ? 3 : 1;
  const bool colored_source = optical_depth.channels.size() == 3;
  return MapPixels(optical_depth, ValueChannels(colored),
                   [&](const float* depth, float* transmittance) {
                     for (size_t c = 0; c < channels; ++c) {
                       const float density = light.shadow_density[static_cast<glm::length_t>(c)];
                       transmittance[c] = std::exp(-density * depth[colored_source ? c : 0]);
                     }
                   });
}

namespace {

Image SelectImage(const ImageRequest& request, const Scene& scene, const DrawnImages& drawn) {
  const auto light = static_cast<size_t>(request.light_index);
  switch (request.kind) {
    case ImageKind::kBeauty:
    case ImageKind::kError:  // refused by PlanFrame
      break;
    case ImageKind::kCoverage:
      return CoverageOf(drawn.beauty);
    case ImageKind::kDepth:
      return DepthOf(drawn.depth);
    case ImageKind::kLightTransmittance:
      return TransmittanceOf(drawn.transmittance[light], scene.lights[light].colored_density());
    case ImageKind::kLightBuffer:
      return LightImage(drawn.shadows[light].light_buffer, request.quantity, scene.lights[light]);
    case ImageKind::kLightLayers:
      return LightImage(drawn.shadows[light].light_layers, request.quantity, scene.lights[light]);
  }
  return drawn.beauty;
}

}  // namespace

std::vector<Image> SelectImages(const FrameRequest& request, DrawnImages&& drawn) {
  std::vector<Image> images(request.images.size());
  std::optional<size_t> last_beauty;
  for (size_t i = 0; i < images.size(); ++i) {
    if (request.images[i].kind == ImageKind::kBeauty) last_beauty = i;
  }
  for (size_t i = 0; i < images.size(); ++i) {
    if (i != last_beauty) images[i] = SelectImage(request.images[i], request.scene, drawn);
  }
  if (last_beauty) images[*last_beauty] = std::move(drawn.beauty);
  return images;
}

}  // namespace halflight
