// What becomes of samples: their mean, or what lies between them.
#include <gtest/gtest.h>

#include "renderer/sweep/resample.h"

namespace halflight::sweep {
namespace {

// A ramp: channel c of sample (x, y) is x + 10 y + 100 c.
Image Ramp(int width, int height) {
  Image image{width, height, 1, {"R", "G", "B", "A"}, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 4; ++c) {
        image.pixels.push_back(static_cast<float>(x + 10 * y + 100 * c));
      }
    }
  }
  return image;
}

TEST(Resample, AveragesSupersamples) {
  const Image image = Resample(Ramp(6, 4), {.supersample = 2}, {3, 2});
  ASSERT_EQ(image.pixels.size(), 24U);
  EXPECT_FLOAT_EQ(image.pixels[0], 5.5F);
  EXPECT_FLOAT_EQ(image.pixels[(1 * 3 + 2) * 4 + 1], 4.5F + 25.0F + 100.0F);
}

TEST(Resample, InterpolatesBetweenSamplesThatLieApart) {
  const Image image = Resample(Ramp(3, 2), {.downsample = 2}, {6, 4});
  ASSERT_EQ(image.pixels.size(), 96U);
  // Sample (0, 0) is at 1, 1 in pixels; outside the samples' centres the nearest holds.
  EXPECT_FLOAT_EQ(image.pixels[0], 0.0F);
  EXPECT_FLOAT_EQ(image.pixels[(1 * 6 + 1) * 4], 0.25F + 2.5F);
  EXPECT_FLOAT_EQ(image.pixels[(1 * 6 + 2) * 4], 0.75F + 2.5F);
  EXPECT_FLOAT_EQ(image.pixels[(3 * 6 + 5) * 4], 12.0F);
}

TEST(Resample, LeavesOneSampleAPixelAlone) {
  EXPECT_EQ(Resample(Ramp(3, 2), {}, {3, 2}).pixels, Ramp(3, 2).pixels);
}

}  // namespace
}  // namespace halflight::sweep
