// Cuts an image that is larger than a render target may be into bands that are drawn side by side.
// No GL.
#pragma once

#include <vector>

#include <glm/vec2.hpp>

#include "renderer/scene.h"

namespace halflight {

struct Band {
  PixelRect pixels;   // of the image that is rendered (the camera's window)
  PixelRect samples;  // of its samples: those that the pixels are made of
};

// Bands that together have every pixel of `window_size` once, row by row; no side of one, in pixels
// or in samples, is longer than `max_side`, at least 16. Where one sample serves several pixels,
// which are interpolated, neighbours share samples. `composite_size`: all samples.
std::vector<Band> CutIntoBands(const glm::ivec2& window_size, const glm::ivec2& composite_size,
                               const Sampling& sampling, int max_side);

}  // namespace halflight
