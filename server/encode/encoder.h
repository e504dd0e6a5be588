// What every format's encoder is handed, and what is checked for all of them beforehand.
// One encoder is one pair of files, and one row in the table of encode.cpp for each of its formats.
#pragma once

#include "server/encode/encode.h"

namespace halflight {

// Valid: EncodeImage has checked channels, sizes and text. Refers to EncodeImage's arguments.
struct EncodeInput {
  const SharedImage& image;
  ImageKind kind;
  LightQuantity quantity;
  const EncodeSettings& settings;
  const ImageMetadata& metadata;
};

inline bool ShowsLight(ImageKind kind) {
  return kind == ImageKind::kLightBuffer || kind == ImageKind::kLightLayers;
}

}  // namespace halflight
