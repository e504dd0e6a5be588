// Frames over the wire whose every pixel is known in closed form.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

constexpr int kSize = 32;

// One particle at the origin in white light from the left, seen from z = 4.
Scene OneParticle(Profile profile) {
  Scene scene = test::BallScene(1, kSize);
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{0, 0, 0}};
  scene.particles = set;
  scene.lights = {test::Sun({1, -0.2, -0.1})};
  scene.material.profile = profile;
  scene.material.radius = 1.0F;
  scene.material.opacity = 0.6F;
  scene.material.albedo = {1.0F, 0.5F, 0.25F};
  return scene;
}

// The impact parameter of a pixel's ray at the origin, for the camera of test::BallScene.
double ImpactOf(int x, int y) {
  const double tangent = std::tan(20.0 * std::numbers::pi / 180.0);
  const double px = (x + 0.5 - kSize / 2.0) / (kSize / 2.0) * tangent;
  const double py = (y + 0.5 - kSize / 2.0) / (kSize / 2.0) * tangent;
  const double squared = px * px + py * py;
  return 4.0 * std::sqrt(squared / (1.0 + squared));
}

double AlphaOf(double impact, double opacity, Profile profile) {
  const double rho_squared = impact * impact;
  if (rho_squared >= 1.0) {
    return 0.0;
  }
  const double w = profile == Profile::kSoft ? 1.0 - rho_squared : std::sqrt(1.0 - rho_squared);
  return 1.0 - std::pow(1.0 - opacity, w);
}

TEST(ClosedForm, OneParticleIsItsOpacityTimesItsLight) {
  const TestServer server;
  client::Client client = server.Connect();
  for (const Profile profile : {Profile::kSoft, Profile::kBall}) {
    const Scene scene = OneParticle(profile);
    const auto pixels = FloatsOf(MustRender(client, RequestOf(scene)).outputs[0]);
    ASSERT_EQ(pixels.size(), kSize * kSize * 4U);
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const double alpha = AlphaOf(ImpactOf(x, y), 0.6F, profile);
        const float* const pixel = &pixels[static_cast<size_t>(y * kSize + x) * 4];
        EXPECT_NEAR(pixel[3], alpha, 1e-5) << x << ", " << y;
        for (int c = 0; c < 3; ++c) {
          // Nothing shadows it, itself least of all: ambient 0.1, and all of the light.
          EXPECT_NEAR(pixel[c], scene.material.albedo[c] * 1.1 * alpha, 2e-5) << x << ", " << y;
        }
      }
    }
  }
}

TEST(ClosedForm, CoaxialParticlesMultiplyWhatTheyLetThrough) {
  const TestServer server;
  client::Client client = server.Connect();
  for (const int count : {2, 7, 40}) {
    Scene scene = OneParticle(Profile::kSoft);
    scene.camera.projection = Orthographic{2.5};
    scene.material.opacity = 0.15F;
    auto set = std::make_shared<ParticleSet>();
    for (int i = 0; i < count; ++i) {
      set->positions.emplace_back(0.0F, 0.0F, 0.05F * static_cast<float>(i) - 1.0F);
    }
    scene.particles = set;
    const auto pixels =
        FloatsOf(MustRender(client, RequestOf(scene, v1::OUTPUT_KIND_COVERAGE)).outputs[0]);
    ASSERT_EQ(pixels.size(), static_cast<size_t>(kSize * kSize));
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const double impact =
            std::hypot(x + 0.5 - kSize / 2.0, y + 0.5 - kSize / 2.0) * 2.5 / kSize;
        const double one = AlphaOf(impact, 0.15F, Profile::kSoft);
        EXPECT_NEAR(pixels[static_cast<size_t>(y * kSize + x)], 1.0 - std::pow(1.0 - one, count),
                    1e-5);
      }
    }
  }
}

TEST(ClosedForm, WithoutShadowsLightIsTheSameEverywhereWhateverTheShadowSettings) {
  const TestServer server;
  client::Client client = server.Connect();
  Scene scene = test::BallScene(400, kSize);
  scene.lights = {test::Sun({1, -1, -0.5}, 0.0F)};
  const auto pixels = FloatsOf(MustRender(client, RequestOf(scene)).outputs[0]);
  ASSERT_EQ(pixels.size(), kSize * kSize * 4U);
  double covered = 0.0;
  for (size_t i = 0; i < pixels.size(); i += 4) {
    EXPECT_NEAR(pixels[i], 1.1 * pixels[i + 3], 1e-5);
    covered = std::max(covered, static_cast<double>(pixels[i + 3]));
  }
  EXPECT_GT(covered, 0.9) << "an image that shows nothing proves nothing";

  scene.shadow = {.slices = 7, .interpolate = false, .light_buffer_size = 32};
  scene.shadow.spacing = SliceSpacing::kEqualOpticalDepth;
  EXPECT_EQ(FloatsOf(MustRender(client, RequestOf(scene)).outputs[0]), pixels);

  scene.lights = {test::Sun({1, -1, -0.5}, 1.0F)};
  EXPECT_GT(MaxDifference(FloatsOf(MustRender(client, RequestOf(scene)).outputs[0]), pixels), 0.1)
      << "shadows show where they are asked for";
}

}  // namespace
}  // namespace halflight::loopback
