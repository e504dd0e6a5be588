#include "renderer/sweep/resample.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/parallel.h"
#include "renderer/pixel_memory.h"

namespace halflight::sweep {

namespace {

const float* Texel(const Image& image, int x, int y) {
  x = std::clamp(x, 0, image.width - 1);
  y = std::clamp(y, 0, image.height - 1);
  return &image.pixels[(static_cast<size_t>(y) * image.width + x) * 4];
}

void Average(const Image& samples, int n, int x, int y, float* pixel) {
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const float* const sample = Texel(samples, x * n + column, y * n + row);
      for (int c = 0; c < 4; ++c) pixel[c] += sample[c];
    }
  }
  for (int c = 0; c < 4; ++c) pixel[c] /= static_cast<float>(n * n);
}

void Interpolate(const Image& samples, int n, int x, int y, float* pixel) {
  const float at_x = (static_cast<float>(x) + 0.5F) / static_cast<float>(n) - 0.5F;
  const float at_y = (static_cast<float>(y) + 0.5F) / static_cast<float>(n) - 0.5F;
  const float left = std::floor(at_x);
  const float top = std::floor(at_y);
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      const float weight = (column == 0 ? 1.0F - (at_x - left) : at_x - left) *
                           (row == 0 ? 1.0F - (at_y - top) : at_y - top);
      const float* const sample =
          Texel(samples, static_cast<int>(left) + column, static_cast<int>(top) + row);
      for (int c = 0; c < 4; ++c) pixel[c] += weight * sample[c];
    }
  }
}

}  // namespace

Image Resample(Image samples, const Sampling& sampling, const glm::ivec2& size) {
  if (sampling.supersample == 1 && sampling.downsample == 1) return samples;
  Image image{size.x, size.y, 1, samples.channels, {}};
  const auto width = static_cast<size_t>(size.x);
  image.pixels = Zeros(width * size.y * 4);
  ParallelRanges(width * size.y, [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end; ++i) {
      const auto x = static_cast<int>(i % width);
      const auto y = static_cast<int>(i / width);
      if (sampling.supersample > 1) {
        Average(samples, sampling.supersample, x, y, &image.pixels[4 * i]);
      } else {
        Interpolate(samples, sampling.downsample, x, y, &image.pixels[4 * i]);
      }
    }
  });
  return image;
}

}  // namespace halflight::sweep
