// What a scattering medium does to a light, against integrals and limits.
#include "renderer/scattering.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/renderer/test_scene.h"

namespace halflight {
namespace {

// A block of particles on a lattice, 1 x 1 across and 1 deep along z, of this optical depth.
Scene Block(double optical_depth) {
  constexpr int kAcross = 32;
  constexpr int kDeep = 64;
  constexpr double kRadius = 0.01;
  auto set = std::make_shared<ParticleSet>();
  for (int x = 0; x < kAcross; ++x) {
    for (int y = 0; y < kAcross; ++y) {
      for (int z = 0; z <= kDeep; ++z) {
        set->positions.emplace_back(glm::vec3(x, y, 0) / static_cast<float>(kAcross) +
                                    glm::vec3(0, 0, static_cast<float>(z) / kDeep));
      }
    }
  }
  Scene scene;
  scene.particles = set;
  scene.material.radius = kRadius;
  // Each layer's share, spread over the lattice's area.
  const double tau = optical_depth / ((kDeep + 1.0) * kAcross * kAcross * 0.5 * std::numbers::pi *
                                      kRadius * kRadius);
  scene.material.opacity = static_cast<float>(-std::expm1(-tau));
  scene.lights = {test::Sun({0, 0, 1})};
  return scene;
}

PhysicalSpread SpreadOf(const Scene& scene, const PhysicalScattering& scattering) {
  return {ParticleView(scene), scene.lights[0], {0, 0, 1}, scattering, scene.material.profile};
}

TEST(ForwardFraction, IsTheIntegralOfThePhaseFunctionOverTheHemisphereAhead) {
  for (const double g : {-0.7, -1e-5, 0.0, 1e-5, 1e-3, 0.5, 0.8, 0.9}) {
    constexpr int kSteps = 1000000;
    double sum = 0.0;
    for (int step = 0; step < kSteps; ++step) {
      const double cosine = (step + 0.5) / kSteps;
      const double d = 1.0 + g * g - 2.0 * g * cosine;
      sum += 0.5 * (1.0 - g * g) / (d * std::sqrt(d)) / kSteps;
    }
    EXPECT_NEAR(ForwardFraction(g), sum, 1e-7) << g;
  }
}

TEST(ForwardExtinction, FallsFromAllToWhatIsScatteredBack) {
  EXPECT_EQ(ForwardExtinction({0.8F, 0.0F}), 1.0);
  EXPECT_EQ(ForwardExtinction({0.0F, 1.0F}), 0.5);
  EXPECT_NEAR(ForwardExtinction({0.5F, 1.0F}), 0.17082, 1e-5);
  EXPECT_GT(ForwardExtinction({0.999999F, 1.0F}), 0.0);
}

// Light scattered once, at depth z with the variance (1 - g^2) / 3 of the direction, has at depth s
// the variance (1 - g^2) / 3 (s - z)^2; a share b dz of a thin beam is scattered there. Of the beam
// that makes b (1 - g^2) s^3 / 9 (Fermi and Eyges). Layers that spread what is in front of them
// alike spread light by V(s) - V(z), which has the same sum where V(s) = (1 - g^2) s^2 / 6.
TEST(PhysicalSpread, OfAThinMediumIsThatOfFermiAndEyges) {
  for (const double g : {0.5, 0.8, 0.9}) {
    const PhysicalSpread spread = SpreadOf(Block(0.01), {static_cast<float>(g), 1.0F});
    double sum = 0.0;  // of V(1) - V(z) over z
    constexpr int kSteps = 1000;
    for (int step = 0; step < kSteps; ++step) {
      const double z = (step + 0.5) / kSteps;
      const double variance = spread.VarianceAt(z - 0.5).r;
      sum += (spread.VarianceAt(0.5).r - variance) / kSteps;
      EXPECT_NEAR(variance, (1.0 - g * g) / 6.0 * z * z, 0.02 * (1.0 - g * g) / 6.0);
    }
    EXPECT_NEAR(sum / ((1.0 - g * g) / 9.0), 1.0, 0.02) << g;
  }
}

TEST(PhysicalSpread, OfADenseMediumIsLessSinceLightIsTurned) {
  const PhysicalScattering scattering{0.8F, 1.0F};
  const double thin = SpreadOf(Block(0.01), scattering).VarianceAt(0.5).r;
  const double dense = SpreadOf(Block(10.0), scattering).VarianceAt(0.5).r;
  EXPECT_LT(dense, 2.5 * thin);
  // Diffusion, Lewis 1950: the variance of a path of length s is at most 2 s / (3 b (1 - g)).
  const double densest = SpreadOf(Block(100.0), scattering).VarianceAt(0.5).r;
  EXPECT_LT(densest, 2.0 / (3.0 * 100.0 * 0.2));
  EXPECT_GT(densest, 0.2 * 2.0 / (3.0 * 100.0 * 0.2));
}

TEST(PhysicalSpread, GrowsAlongTheLightAndStaysPutOutsideTheCloud) {
  const PhysicalSpread spread = SpreadOf(Block(3.0), {0.8F, 0.9F});
  EXPECT_EQ(spread.VarianceAt(-100.0).r, 0.0);
  double before = 0.0;
  for (double z = -0.5; z <= 0.5; z += 0.01) {
    const double variance = spread.VarianceAt(z).r;
    EXPECT_GE(variance, before);
    before = variance;
  }
  EXPECT_EQ(spread.VarianceAt(std::numeric_limits<double>::infinity()).r, spread.VarianceAt(0.5).r);
}

TEST(PhysicalSpread, OfCloudsWithoutDepthOrParticlesIsNone) {
  Scene scene = Block(1.0);
  auto flat = std::make_shared<ParticleSet>(*scene.particles);
  for (glm::vec3& position : flat->positions) position.z = 0.0F;
  scene.particles = flat;
  EXPECT_EQ(SpreadOf(scene, {0.5F, 1.0F}).VarianceAt(1.0).r, 0.0);
  scene.particles = std::make_shared<ParticleSet>();
  EXPECT_EQ(SpreadOf(scene, {0.5F, 1.0F}).VarianceAt(1.0).r, 0.0);
}

}  // namespace
}  // namespace halflight
