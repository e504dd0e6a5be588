// Pixels as they leave the renderer, and which images there are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace halflight {

// Scene-linear 32-bit floats: layer by layer, row by row from the top, channels interleaved.
struct Image {
  int width = 0;
  int height = 0;
  int layers = 1;
  std::vector<std::string> channels;  // names: R, G, B, A, Y, Z
  std::vector<float> pixels;          // layers * height * width * channels.size()
};

enum class ImageKind : uint8_t {
  kBeauty,              // R G B A, premultiplied
  kCoverage,            // A
  kDepth,               // Z; +infinity where nothing is covered
  kLightTransmittance,  // Y or R G B; 1 where nothing is covered
  kLightBuffer,         // Y or R G B
  kLightLayers,         // as kLightBuffer, one layer a slice
  kError,               // R G B; of a beauty that is there: error_map.h, not the renderer, makes it
};

enum class LightQuantity : uint8_t { kTransmittance, kOpticalDepth };

// One image wanted of a frame. The last two only matter to kinds that show a light.
struct ImageRequest {
  ImageKind kind = ImageKind::kBeauty;
  int light_index = 0;
  LightQuantity quantity = LightQuantity::kTransmittance;
};

}  // namespace halflight
