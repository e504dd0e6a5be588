// The blur of the light buffer on the CPU against the formulas of shaders/blur.frag in float64.
#include "renderer/sweep/light_planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "renderer/blur_kernel.h"

namespace halflight::sweep {
namespace {

using Plane = std::vector<double>;  // row by row

double At(const Plane& plane, int size, int x, int y) {
  const bool outside = x < 0 || y < 0 || x >= size || y >= size;
  return outside ? 0.0 : plane[static_cast<size_t>(y * size + x)];
}

// One axis, in long double, so that no trick is needed for digits; `unscattered` may be null.
Plane Blurred(Plane depth, const Plane* unscattered, int size, double variance, double density,
              bool along_x) {
  for (const BlurStep& step : BlurSteps(glm::dvec3(variance), size)) {
    const std::vector<float> weights = DiscreteGaussian(step.variance.x);
    const int radius = static_cast<int>(weights.size()) - 1;
    Plane blurred(depth.size());
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        // Light lost and light kept: each has the digits that the other has not.
        long double lost = 0.0L;
        long double kept = 0.0L;
        const auto exponent_of = [&](const Plane& plane, int at_x, int at_y) {
          return static_cast<long double>(density) * At(plane, size, at_x, at_y);
        };
        for (int d = -radius; d <= radius; ++d) {
          const int tap = d * static_cast<int>(step.stride);
          const int tx = along_x ? x + tap : x;
          const int ty = along_x ? y : y + tap;
          const long double weight = weights[static_cast<size_t>(std::abs(d))];
          const long double all = exponent_of(depth, tx, ty);
          long double spreads = std::exp(-all);
          long double met = -std::expm1(-all);
          if (unscattered != nullptr) {
            const long double stays = exponent_of(*unscattered, tx, ty);
            spreads -= std::exp(-stays);
            met += std::expm1(-stays);
          }
          lost += weight * met;
          kept += weight * spreads;
        }
        if (unscattered != nullptr) {
          kept += std::exp(-exponent_of(*unscattered, x, y));
          lost -= std::expm1(-exponent_of(*unscattered, x, y));
        }
        blurred[static_cast<size_t>(y * size + x)] = std::max(
            0.0, static_cast<double>(lost < 0.5L ? -std::log1p(-lost) : -std::log(kept)) / density);
      }
    }
    depth = blurred;
  }
  return depth;
}

struct Case {
  const char* name;
  int size;
  double peak;  // optical depth in the middle
  BlurVariance variance;
  bool unscattered;
  double tolerance;  // of exp(-depth), or below a depth of 1 of the depth, relative
};

class BlurPlanesOf : public testing::TestWithParam<Case> {};

TEST_P(BlurPlanesOf, IsThatOfTheFormulas) {
  const Case& tested = GetParam();
  const int size = tested.size;
  constexpr float kDensity = 0.7F;
  LightPlanes planes(size, false, tested.unscattered);
  Plane depth(static_cast<size_t>(size * size));
  Plane unscattered(depth.size());
  std::mt19937 random(3);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double dx = (x - 0.45 * size) / (0.3 * size);
      const double dy = (y - 0.6 * size) / (0.3 * size);
      const double noise = 0.75 + 0.25 * static_cast<double>(random()) * 0x1p-32;
      const double value = tested.peak * noise * std::max(0.0, 1.0 - dx * dx - dy * dy);
      const auto place = static_cast<size_t>(y * planes.pitch + x);
      planes.depth[0][place] = static_cast<float>(value);
      depth[static_cast<size_t>(y * size + x)] = planes.depth[0][place];
      if (!tested.unscattered) continue;
      planes.unscattered[place] = static_cast<float>(3.0 * value);
      unscattered[static_cast<size_t>(y * size + x)] = planes.unscattered[place];
    }
  }
  const Plane* const also = tested.unscattered ? &unscattered : nullptr;
  const Plane expected = Blurred(Blurred(depth, also, size, tested.variance.x.r, kDensity, true),
                                 also, size, tested.variance.y.r, kDensity, false);
  BlurPlanes(tested.variance, glm::vec3(kDensity), planes);
  double largest = 0.0;
  double deepest = 0.0;
  double moved = 0.0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < planes.pitch; ++x) {
      const double value = planes.depth[0][static_cast<size_t>(y * planes.pitch + x)];
      if (x >= size) {
        ASSERT_EQ(value, 0.0);
        continue;
      }
      const double right = expected[static_cast<size_t>(y * size + x)];
      ASSERT_TRUE(std::isfinite(value));
      largest =
          std::max(largest, tested.peak < 1.0 ? std::abs(value - right) / tested.peak
                                              : std::abs(std::exp(-value) - std::exp(-right)));
      // Scattered light is what two floats differ by: less than 1e-6 of all light has no digits.
      if (tested.unscattered && right * kDensity > 14.0) {
        EXPECT_GT(value * kDensity, 13.0);
      } else if (right > 1.0) {
        deepest = std::max(deepest, std::abs(value / right - 1.0));
      }
      moved = std::max(moved, std::abs(right - depth[static_cast<size_t>(y * size + x)]));
    }
  }
  EXPECT_LT(largest, tested.tolerance);
  EXPECT_LT(deepest, 1e-4);
  EXPECT_GT(moved, 0.01 * std::min(tested.peak, 1.0));
}

BlurVariance Of(double x, double y) { return {glm::dvec3(x), glm::dvec3(y)}; }

INSTANTIATE_TEST_SUITE_P(
    Buffers, BlurPlanesOf,
    testing::Values(Case{"OfOneSmallStep", 64, 3.0, Of(0.2, 0.3), false, 1e-6},
                    Case{"Oblong", 61, 3.0, Of(9.0, 2.0), false, 2e-6},
                    Case{"InStrides", 130, 3.0, Of(300.0, 2000.0), false, 4e-6},
                    Case{"WiderThanTheBuffer", 40, 3.0, Of(1e9, 1e9), false, 4e-6},
                    Case{"Faint", 64, 1e-6, Of(4.0, 4.0), false, 1e-5},
                    Case{"Opaque", 64, 3000.0, Of(4.0, 4.0), false, 2e-6},
                    Case{"BesideUnscattered", 61, 3.0, Of(9.0, 2.0), true, 2e-6},
                    Case{"FaintBesideUnscattered", 64, 1e-6, Of(4.0, 4.0), true, 1e-5},
                    Case{"OpaqueBesideUnscattered", 64, 3000.0, Of(4.0, 4.0), true, 2e-6}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(BlurPlanes, LeavesAColourThatNothingAttenuatesAndTreatsEveryOtherByItself) {
  const int size = 48;
  LightPlanes colored(size, true, false);
  LightPlanes grey(size, false, false);
  for (std::vector<float>* plane :
       {&colored.depth[0], &colored.depth[1], &colored.depth[2], &grey.depth[0]}) {
    std::fill_n(plane->begin() + 20 * size + 16, 9, 2.0F);
  }
  const std::vector<float> before = colored.depth[0];
  const BlurVariance variance{{3.0, 3.0, 1.0}, {2.0, 2.0, 1.0}};
  BlurPlanes(variance, {0.0F, 1.5F, 1.0F}, colored);
  BlurPlanes({glm::dvec3(3.0), glm::dvec3(2.0)}, glm::vec3(1.5F), grey);
  EXPECT_EQ(colored.depth[0], before);
  EXPECT_EQ(colored.depth[1], grey.depth[0]);
  EXPECT_NE(colored.depth[2], grey.depth[0]);
}

}  // namespace
}  // namespace halflight::sweep
