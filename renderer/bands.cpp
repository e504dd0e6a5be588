#include "renderer/bands.h"

#include <algorithm>

namespace halflight {

namespace {

struct Side {
  int first_pixel;
  int pixels;
  int first_sample;
  int samples;
};

std::vector<Side> CutSide(int pixels, int samples, const Sampling& sampling, int max_side) {
  const int up = sampling.supersample;
  const int down = sampling.downsample;
  // Whole samples a band. Bilinear interpolation reaches one further on each side.
  const int border = down > 1 ? 1 : 0;
  const int longest =
      down > 1 ? std::min(max_side / down, max_side - 2 * border) * down : max_side / up;
  std::vector<Side> sides;
  for (int first = 0; first < pixels; first += longest) {
    const int count = std::min(longest, pixels - first);
    const int begin = std::max(first * up / down - border, 0);
    const int end = std::min(((first + count) * up + down - 1) / down + border, samples);
    sides.push_back({first, count, begin, end - begin});
  }
  return sides;
}

}  // namespace

std::vector<Band> CutIntoBands(const glm::ivec2& window_size, const glm::ivec2& composite_size,
                               const Sampling& sampling, int max_side) {
  const std::vector<Side> columns = CutSide(window_size.x, composite_size.x, sampling, max_side);
  std::vector<Band> bands;
  for (const Side& y : CutSide(window_size.y, composite_size.y, sampling, max_side)) {
    for (const Side& x : columns) {
      bands.push_back({{x.first_pixel, y.first_pixel, x.pixels, y.pixels},
                       {x.first_sample, y.first_sample, x.samples, y.samples}});
    }
  }
  return bands;
}

}  // namespace halflight
