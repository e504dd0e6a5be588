// Every set of kernels that this CPU can run, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "renderer/sweep/kernel_sets.h"

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

class EveryKernelSet : public testing::TestWithParam<KernelSet> {
 protected:
  static const Kernels& Get() { return GetParam().kernels; }
};

TEST_P(EveryKernelSet, AddUpAMillionThinLayers) {
  const Stack stack(1'000'000, 1e-6F);
  const auto pixels = stack.Composite(Get());
  const double expected = 1.0 - std::exp(-1e-6F * 1e6);
  EXPECT_NEAR(pixels[3 * kPixels], expected, 2e-6);
  EXPECT_NEAR(pixels[0], expected, 2e-6);
  EXPECT_NEAR(pixels[kPixels], 0.5 * expected, 1e-6);
}

TEST_P(EveryKernelSet, HideWhatLiesBehindOpaqueLayers) {
  Stack stack(10, 16.0F);
  stack.unshadowed[0] = {0.25F, 0.0F, 0.0F};
  const auto pixels = stack.Composite(Get());
  EXPECT_NEAR(pixels[0], 0.25F, 1e-6);
  EXPECT_EQ(pixels[3 * kPixels], 1.0F);
}

// A column of light texels along which the particles lie: each meets the sum of those before it.
TEST_P(EveryKernelSet, SweepDepositsInOrder) {
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

// Lit sprites of all kinds in one tile, at every degree.
struct Lit {
  static constexpr size_t kCount = 200;
  std::vector<Sprite> sprites;
  std::vector<uint16_t> rows;
  std::vector<Rgb> unshadowed;
  std::vector<Rgb> lit;
  std::vector<float> exponent;
  std::vector<float> depth_of;
  std::vector<uint32_t> entries;
  std::array<bool, kMaxTileLights> shadow_alone = {true, false};
  ImageTileJob job;

  // `steepness` times exponents of about 1.
  Lit(int degree, int lights, int exponents, bool extras, float steepness) {
    std::mt19937 random(static_cast<unsigned>(degree * 100 + lights * 10 + exponents));
    const auto between = [&](float low, float high) {
      return std::uniform_real_distribution<float>(low, high)(random);
    };
    const auto color = [&] { return Rgb{between(0, 1), between(0, 1), between(0, 1)}; };
    for (uint32_t i = 0; i < kCount; ++i) {
      const float thickness = i % 3 == 0 ? 2.0F : 0.2F;
      sprites.push_back(
          {between(-0.5F, 0.5F), between(-0.5F, 0.5F), between(2, 20), between(0, thickness)});
      // Rows that it may reach: rays are at most sqrt(1.5) long. The tile begins with row 16.
      const float row = (sprites.back().y + 0.5F) / 0.125F + 16.0F;
      const float reach = 1.3F / sprites.back().scale / 0.125F;
      rows.push_back(static_cast<uint16_t>(std::max(row - reach, 0.0F)));
      rows.push_back(static_cast<uint16_t>(row + reach + 1.0F));
      unshadowed.push_back(color());
      for (int k = 0; k < 3; ++k) depth_of.push_back(between(1, 2));
      for (int l = 0; l < lights; ++l) {
        lit.push_back(color());
        for (int e = 0; e < exponents * Terms(degree); ++e) {
          exponent.push_back(steepness * between(-0.5F, 1));
        }
      }
      entries.push_back(i);
    }
    job.grid = {-0.5F, -0.5F, 0.125F, 0.125F};
    job.shaded.sprites = sprites.data();
    job.shaded.rows = rows.data();
    job.shaded.unshadowed = unshadowed.data();
    job.shaded.depth = extras ? depth_of.data() : nullptr;
    job.shaded.lights = lights;
    job.shaded.exponents = exponents;
    job.shaded.shadow_alone = shadow_alone.data();
    job.shaded.degree = degree;
    job.shaded.lit = lit.data();
    job.shaded.exponent = exponent.data();
    job.entries = entries.data();
    job.entry_count = kCount;
    job.first_row = 16;
  }

  // Planes: red, green, blue, coverage, depth, transmittance.
  [[nodiscard]] std::vector<double> Composite(const Kernels& kernels) const {
    std::vector<float> planes(static_cast<size_t>((5 + 3 * job.shaded.lights) * kPixels));
    ImageTileJob own = job;
    own.pixels = planes.data();
    if (job.shaded.depth != nullptr) {
      own.depth = &planes[4 * kPixels];
      own.transmittance = &planes[5 * kPixels];
    }
    kernels.composite_image_tile(own);
    return {planes.begin(), planes.end()};
  }

  // The same in float64, as the job's fields define it.
  [[nodiscard]] std::vector<double> Expected() const {
    const ShadedSprites& shaded = job.shaded;
    const int lights = shaded.lights;
    std::vector<double> planes(static_cast<size_t>((5 + 3 * lights) * kPixels));
    for (int pixel = 0; pixel < kPixels; ++pixel) {
      const int row = pixel / kImageTile;
      const double px = job.grid.first_x + (pixel % kImageTile + 0.5) * job.grid.step_x;
      const double py = job.grid.first_y + (row + 0.5) * job.grid.step_y;
      const auto at = [&](int plane) -> double& {
        return planes[static_cast<size_t>(plane * kPixels + pixel)];
      };
      for (uint32_t i = 0; i < kCount; ++i) {
        const Sprite& sprite = sprites[i];
        const double x = (px - sprite.x) * sprite.scale;
        const double y = (py - sprite.y) * sprite.scale;
        const double turn = sprite.x * y - sprite.y * x;
        const double rho_squared = (x * x + y * y + turn * turn) / (px * px + py * py + 1.0);
        if (rho_squared >= 1.0) continue;
        const double alpha = -std::expm1(-sprite.optical_depth * (1.0 - rho_squared));
        const double seen = alpha * (1.0 - at(3));
        double color[3] = {unshadowed[i].red, unshadowed[i].green, unshadowed[i].blue};
        for (int l = 0; l < lights; ++l) {
          const auto li = static_cast<size_t>(i) * lights + l;
          const float own[3] = {lit[li].red, lit[li].green, lit[li].blue};
          for (int c = 0; c < 3; ++c) {
            const int e = shaded.exponents == 3 ? c : 0;
            const float* p = &exponent[(li * shaded.exponents + e) * Terms(shaded.degree)];
            double sum = 0.0;
            for (int a = 0; a <= shaded.degree; ++a) {
              for (int b = 0; a + b <= shaded.degree; ++b) {
                sum += *p++ * std::pow(x, a) * std::pow(y, b);
              }
            }
            const double t =
                std::exp(-(shadow_alone[static_cast<size_t>(l)] ? std::max(sum, 0.0) : sum));
            color[c] += own[c] * t;
            if (shaded.depth != nullptr) at(5 + 3 * l + c) += t * seen;
          }
        }
        for (int c = 0; c < 3; ++c) at(c) += color[c] * seen;
        at(3) += seen;
        const float* const d = &depth_of[size_t{3} * i];
        if (shaded.depth != nullptr) at(4) += (d[0] + d[1] * y + d[2] * x) * seen;
      }
    }
    return planes;
  }
};

TEST_P(EveryKernelSet, CompositesWhatTheJobSays) {
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    for (const int lights : {1, 2}) {
      for (const int exponents : {1, 3}) {
        for (const bool extras : {false, true}) {
          for (const float steepness : {1.0F, 60.0F}) {
            const Lit tile(degree, lights, exponents, extras, steepness);
            // Lights that are no shadows alone may grow without bound.
            if (lights == 2 && steepness > 1.0F) continue;
            const std::vector<double> drawn = tile.Composite(Get());
            const std::vector<double> expected = tile.Expected();
            for (size_t i = 0; i < drawn.size(); ++i) {
              // Exponents are rounded in proportion to their size.
              ASSERT_NEAR(drawn[i], expected[i],
                          (2e-6 + 4e-7 * steepness) * std::max(1.0, expected[i]))
                  << "value " << i << ", degree " << degree << ", lights " << lights
                  << ", exponents " << exponents << ", extras " << extras << ", steepness "
                  << steepness;
            }
          }
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfThisCpu, EveryKernelSet, testing::ValuesIn(ListKernels()),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace halflight::sweep
