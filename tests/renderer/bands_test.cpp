// Bands: every pixel once, every sample that it needs, no side too long.
#include "renderer/bands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <string>

namespace halflight {
namespace {

constexpr int kMaxSide = 64;

TEST(Bands, HaveEveryPixelOnceAndTheSamplesOfEach) {
  const glm::ivec2 window(201, 97);
  for (const Sampling sampling :
       {Sampling{1, 1}, Sampling{2, 1}, Sampling{3, 1}, Sampling{1, 2}, Sampling{1, 5}}) {
    SCOPED_TRACE(std::to_string(sampling.supersample) + " / " +
                 std::to_string(sampling.downsample));
    const int up = sampling.supersample;
    const int down = sampling.downsample;
    const glm::ivec2 samples = (window * up + (down - 1)) / down;
    std::vector<int> seen(static_cast<size_t>(window.x * window.y), 0);
    for (const Band& band : CutIntoBands(window, samples, sampling, kMaxSide)) {
      EXPECT_LE(std::max(band.pixels.width, band.pixels.height), kMaxSide);
      EXPECT_LE(std::max(band.samples.width, band.samples.height), kMaxSide);
      EXPECT_GE(std::min(band.samples.x, band.samples.y), 0);
      EXPECT_LE(band.samples.x + band.samples.width, samples.x);
      EXPECT_LE(band.samples.y + band.samples.height, samples.y);
      const auto holds = [&](int x, int y) {
        x = std::clamp(x, 0, samples.x - 1) - band.samples.x;
        y = std::clamp(y, 0, samples.y - 1) - band.samples.y;
        return x >= 0 && y >= 0 && x < band.samples.width && y < band.samples.height;
      };
      for (int y = band.pixels.y; y < band.pixels.y + band.pixels.height; ++y) {
        for (int x = band.pixels.x; x < band.pixels.x + band.pixels.width; ++x) {
          ++seen[static_cast<size_t>(y * window.x + x)];
          // The first and the last sample that the pixel takes, along each side.
          const auto low = [&](int p) {
            return down > 1 ? static_cast<int>(std::floor((p + 0.5) / down - 0.5)) : p * up;
          };
          const auto high = [&](int p) { return down > 1 ? low(p) + 1 : low(p) + up - 1; };
          ASSERT_TRUE(holds(low(x), low(y)) && holds(high(x), high(y))) << x << " " << y;
        }
      }
    }
    for (const int times : seen) ASSERT_EQ(times, 1);
  }
}

TEST(Bands, AreOneWhereTheImageFits) {
  const std::vector<Band> bands = CutIntoBands({64, 30}, {64, 30}, {}, kMaxSide);
  ASSERT_EQ(bands.size(), 1U);
  EXPECT_EQ(bands[0].pixels.width, 64);
  EXPECT_EQ(bands[0].samples.height, 30);
}

}  // namespace
}  // namespace halflight
