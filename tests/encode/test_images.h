// Small images and encoder calls that the tests of the encoders share.
// Holds no expectations of its own.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "renderer/image.h"
#include "server/encode/encode.h"

namespace halflight {

inline Image MakeImage(int width, int height, std::vector<std::string> channels,
                       std::vector<float> pixels, int layers = 1) {
  return {width, height, layers, std::move(channels), std::move(pixels)};
}

// Colours above 1, below 0 and between; alpha from 0 to 1; every pixel differs.
inline Image MakeBeauty(int width, int height) {
  Image image = MakeImage(width, height, {"R", "G", "B", "A"}, {});
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(width);
      const float v = static_cast<float>(y) / static_cast<float>(height);
      image.pixels.insert(image.pixels.end(), {u * 1.25F, v * v, u * v - 0.01F, (u + v) / 2.0F});
    }
  }
  return image;
}

inline absl::StatusOr<EncodedImage> Encode(const Image& image, ImageKind kind, ImageFormat format,
                                           LightQuantity quantity = LightQuantity::kTransmittance,
                                           const ImageMetadata& metadata = {}) {
  return EncodeImage(std::make_shared<const Image>(image), kind, quantity, {.format = format},
                     metadata);
}

}  // namespace halflight
