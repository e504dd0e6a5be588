// The kernels for this CPU against those for any, and both against closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "renderer/sweep/kernels.h"

namespace halflight::sweep {
namespace {

constexpr int kPixels = kImageTile * kImageTile;

// One white sprite without lights, again and again, seen by parallel rays in the middle of the
// tile.
struct Stack {
  std::vector<Sprite> sprites;
  std::vector<uint16_t> rows;
  std::vector<Rgb> unshadowed;
  std::vector<uint32_t> entries;

  Stack(size_t count, float optical_depth) {
    sprites.assign(count, {0.0F, 0.0F, 1e-3F, optical_depth});
    unshadowed.assign(count, {1.0F, 0.5F, 0.0F});
    for (size_t i = 0; i < count; ++i) {
      rows.insert(rows.end(), {0, kImageTile});
      entries.push_back(static_cast<uint32_t>(i));
    }
  }

  [[nodiscard]] std::array<float, 4 * kPixels> Composite(const Kernels& kernels) const {
    std::array<float, 4 * kPixels> pixels = {};
    ImageTileJob job;
    job.shape.orthographic = true;
    job.grid = {0.0F, 0.0F, 0.0F, 0.0F};
    job.shaded.sprites = sprites.data();
    job.shaded.rows = rows.data();
    job.shaded.unshadowed = unshadowed.data();
    job.entries = entries.data();
    job.entry_count = static_cast<uint32_t>(entries.size());
    job.pixels = pixels.data();
    kernels.composite_image_tile(job);
    return pixels;
  }
};

class EitherKernels : public testing::TestWithParam<bool> {
 protected:
  static const Kernels& Get() { return GetParam() ? BestKernels() : BaselineKernels(); }
};

TEST_P(EitherKernels, AddUpAMillionThinLayers) {
  const Stack stack(1'000'000, 1e-6F);
  const auto pixels = stack.Composite(Get());
  const double expected = 1.0 - std::exp(-1e-6F * 1e6);
  EXPECT_NEAR(pixels[3 * kPixels], expected, 2e-6);
  EXPECT_NEAR(pixels[0], expected, 2e-6);
  EXPECT_NEAR(pixels[kPixels], 0.5 * expected, 1e-6);
}

TEST_P(EitherKernels, HideWhatLiesBehindOpaqueLayers) {
  Stack stack(10, 16.0F);
  stack.unshadowed[0] = {0.25F, 0.0F, 0.0F};
  const auto pixels = stack.Composite(Get());
  EXPECT_NEAR(pixels[0], 0.25F, 1e-6);
  EXPECT_EQ(pixels[3 * kPixels], 1.0F);
}

// A column of light texels along which the particles lie: each meets the sum of those before it.
TEST_P(EitherKernels, SweepDepositsInOrder) {
  const std::vector<Sprite> sprites(5, {0.5F, 0.5F, 2.0F, 0.75F});
  std::vector<LightEntry> entries;
  for (uint32_t i = 0; i < 5; ++i) entries.push_back({i, i, 0, 64, 0, 64});
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    const auto terms = static_cast<size_t>(Terms(degree));
    std::vector<float> moments(5 * 2 * terms);
    std::vector<float> depth(static_cast<size_t>(kLightTile * kLightTile));
    LightTileJob job;
    job.shape.orthographic = true;
    job.grid = {0.0F, 0.0F, 1.0F / kLightTile, 1.0F / kLightTile};
    job.sprites = sprites.data();
    job.entries = entries.data();
    job.entry_count = 5;
    job.degree = degree;
    job.moments = moments.data();
    job.depth = depth.data();
    Get().sweep_light_tile(job);
    const auto rho_squared = [](int texel) {
      const double x = (texel % kLightTile + 0.5) / kLightTile * 2.0 - 1.0;
      const double y = (texel / kLightTile + 0.5) / kLightTile * 2.0 - 1.0;
      return x * x + y * y;
    };
    double weight = 0.0;
    double squared = 0.0;
    for (int texel = 0; texel < kLightTile * kLightTile; ++texel) {
      const double w = std::max(0.0, 1.0 - rho_squared(texel));
      EXPECT_NEAR(depth[static_cast<size_t>(texel)], 5 * 0.75 * w, 1e-5);
      weight += w;
      squared += w * w;
    }
    for (size_t i = 0; i < 5; ++i) {
      EXPECT_NEAR(moments[i * 2 * terms], weight, 1e-4 * weight);
      EXPECT_NEAR(moments[i * 2 * terms + terms], static_cast<double>(i) * 0.75 * squared,
                  1e-4 * weight);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, EitherKernels, testing::Bool(), [](const auto& instance) {
  return instance.param ? "OfThisCpu" : "OfAnyCpu";
});

}  // namespace
}  // namespace halflight::sweep
