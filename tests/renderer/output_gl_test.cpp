// The images besides the beauty, and sampling.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using test::PixelAt;

class Outputs : public test::GlTest {};

// Two particles in a row: the light travels along +x from the near one (left) to the far one.
Scene Pair(const glm::dvec3& light) {
  Scene scene;
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{-0.5F, 0, 0}, {0.5F, 0, 0}};
  scene.particles = set;
  scene.camera = test::LookAt({0, 0, 4}, {0, 0, 0}, 128, 128);
  scene.lights = {test::Sun(light)};
  scene.material.radius = 0.3F;
  scene.material.opacity = 0.5F;
  scene.shadow.slices = 2;
  return scene;
}

TEST_F(Outputs, CoverageIsTheAlphaOfTheBeauty) {
  FrameRequest request = test::Beauty(test::BallScene(500));
  request.images.push_back({ImageKind::kCoverage});
  const FrameResult frame = Render(request);
  ASSERT_EQ(frame.images[1].channels, std::vector<std::string>{"A"});
  for (size_t i = 0; i < frame.images[1].pixels.size(); ++i) {
    ASSERT_EQ(frame.images[1].pixels[i], frame.images[0].pixels[4 * i + 3]);
  }
}

TEST_F(Outputs, DepthOfOneParticleIsWhereTheRayPassesItsCentre) {
  Scene scene = Pair({1, 0, 0});
  FrameRequest request{scene, {{ImageKind::kDepth}}};
  const Image depth = Render(request).images[0];
  // (-0.5, 0, 0) is at pixel 64 - 0.5 / 4 * 64 / tan(20 degrees).
  const int x = static_cast<int>(64.0 - 0.125 * 64.0 / std::tan(20 * test::kDegree));
  EXPECT_NEAR(*PixelAt(depth, x, 64), 4.0, 0.01);
  EXPECT_TRUE(std::isinf(*PixelAt(depth, 2, 2)));
}

TEST_F(Outputs, TransmittanceAtTheSecondParticleIsWhatTheFirstLetsThrough) {
  Scene scene = Pair({1, 0, 0});
  scene.lights[0].shadow_density = {1.0F, 2.0F, 0.0F};
  const FrameResult frame = Render({scene, {{ImageKind::kLightTransmittance}}});
  const Image& image = frame.images[0];
  ASSERT_EQ(image.channels.size(), 3U);
  const int shift = static_cast<int>(0.125 * 64.0 / std::tan(20 * test::kDegree));
  const float* first = PixelAt(image, 64 - shift, 64);
  const float* second = PixelAt(image, 64 + shift, 64);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(first[c], 1.0F, 1e-5F);
  EXPECT_NEAR(second[0], 0.5, 0.005);
  EXPECT_NEAR(second[1], 0.25, 0.005);
  EXPECT_NEAR(second[2], 1.0, 1e-6);
}

TEST_F(Outputs, LightBufferIsTheProductOfAllParticles) {
  Scene scene = Pair({1, 0, 0});
  const FrameResult frame = Render(
      {scene,
       {{ImageKind::kLightBuffer}, {ImageKind::kLightBuffer, 0, LightQuantity::kOpticalDepth}}});
  const glm::dvec4 at = frame.lights[0].light_texture_from_world * glm::dvec4(0.0, 0.0, 0.0, 1.0);
  const int x = static_cast<int>(at.x / at.w * frame.images[0].width);
  const int y = static_cast<int>(at.y / at.w * frame.images[0].height);
  EXPECT_NEAR(*PixelAt(frame.images[0], x, y), 0.25, 1e-3);
  EXPECT_NEAR(*PixelAt(frame.images[1], x, y), 2.0 * std::log(2.0), 5e-3);
  EXPECT_EQ(*PixelAt(frame.images[0], 0, 0), 1.0F);
}

TEST_F(Outputs, LayersEndWithTheLightBufferAndNeverBrighten) {
  Scene scene = test::BallScene(800);
  scene.shadow.slices = 9;
  const FrameResult frame = Render({scene, {{ImageKind::kLightBuffer}, {ImageKind::kLightLayers}}});
  const Image& last = frame.images[0];
  const Image& layers = frame.images[1];
  ASSERT_EQ(layers.layers, 9);
  const size_t size = last.pixels.size();
  ASSERT_EQ(layers.pixels.size(), 9 * size);
  for (size_t i = 0; i < size; ++i) {
    ASSERT_EQ(layers.pixels[8 * size + i], last.pixels[i]);
    for (size_t s = 1; s < 9; ++s) {
      ASSERT_LE(layers.pixels[s * size + i], layers.pixels[(s - 1) * size + i]);
    }
  }
}

TEST_F(Outputs, OfSeveralLightsShowTheLightAskedFor) {
  Scene scene = Pair({1, 0, 0});
  scene.lights.push_back(test::Sun({-1, 0, 0}));
  const FrameResult frame =
      Render({scene, {{ImageKind::kLightTransmittance, 0}, {ImageKind::kLightTransmittance, 1}}});
  const int shift = static_cast<int>(0.125 * 64.0 / std::tan(20 * test::kDegree));
  EXPECT_NEAR(*PixelAt(frame.images[0], 64 - shift, 64), 1.0, 1e-5);
  EXPECT_NEAR(*PixelAt(frame.images[0], 64 + shift, 64), 0.5, 0.005);
  EXPECT_NEAR(*PixelAt(frame.images[1], 64 - shift, 64), 0.5, 0.005);
  EXPECT_NEAR(*PixelAt(frame.images[1], 64 + shift, 64), 1.0, 1e-5);
}

TEST_F(Outputs, SupersampledAreTheMeanOfALargerFrame) {
  Scene scene = test::BallScene(500, 40);
  scene.sampling.supersample = 3;
  const Image averaged = RenderBeauty(scene);
  Scene large = test::BallScene(500, 120);
  const Image samples = RenderBeauty(large);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 4; ++c) {
        double mean = 0.0;
        for (int k = 0; k < 9; ++k) {
          mean += PixelAt(samples, 3 * x + k % 3, 3 * y + k / 3)[c] / 9.0;
        }
        ASSERT_NEAR(PixelAt(averaged, x, y)[c], mean, 1e-4);
      }
    }
  }
}

TEST_F(Outputs, DownsampledKeepTheirSizeAndTheirMean) {
  Scene scene = test::BallScene(2000, 97);
  const Image full = RenderBeauty(scene);
  for (const int n : {2, 3, 8}) {
    scene.sampling.downsample = n;
    const Image enlarged = RenderBeauty(scene);
    ASSERT_EQ(enlarged.width, 97);
    double mean_full = 0.0;
    double mean_enlarged = 0.0;
    double error = 0.0;
    for (size_t i = 0; i < full.pixels.size(); ++i) {
      mean_full += full.pixels[i];
      mean_enlarged += enlarged.pixels[i];
      error += std::pow(full.pixels[i] - enlarged.pixels[i], 2);
    }
    EXPECT_NEAR(mean_enlarged / mean_full, 1.0, 0.02) << n;
    // A shift of half a sample would show here.
    EXPECT_LT(std::sqrt(error / static_cast<double>(full.pixels.size())), 0.02 * n) << n;
  }
}

}  // namespace
}  // namespace halflight
