// From composited samples to the image's pixels, on the CPU.
#pragma once

#include <glm/vec2.hpp>

#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight::sweep {

// As shaders/resolve.frag does: the mean of n x n samples, or bilinear interpolation between
// samples n pixels apart. `samples` is R G B A, premultiplied; itself where sampling asks for
// nothing.
Image Resample(Image samples, const Sampling& sampling, const glm::ivec2& size);

}  // namespace halflight::sweep
