// Times predicted from features of a scene, learnt from times measured.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "tests/target/world.h"

namespace halflight {
namespace {

Settings Sliced(int slices, int light_buffer_size) {
  Settings settings;
  settings.shadow.slices = slices;
  settings.shadow.light_buffer_size = light_buffer_size;
  return settings;
}

TEST(SceneFeatures, AddUpQuadsAndDepths) {
  Scene scene = test::BallScene(2000, 200);
  scene.camera.projection = Orthographic{4.0};
  const SceneFeatures features = FeaturesOf(scene);
  // 0.12 is 6 pixels here, so that quads have 144; the ball is inside the image.
  EXPECT_NEAR(features.quad_samples, 2000 * 144, 1.0);
  EXPECT_NEAR(features.radius_samples, 6.0, 1e-6);
  ASSERT_EQ(features.lights.size(), 1U);
  const LightFeatures& light = features.lights[0];
  EXPECT_EQ(light.share, 1.0);
  EXPECT_NEAR(light.cosine, 0.5 / 1.5, 1e-9);
  EXPECT_NEAR(light.radius, 0.12 / 2.24, 0.002);
  EXPECT_NEAR(light.quad_area, 2000 * 4 * light.radius * light.radius, 0.5);
  EXPECT_NEAR(light.depth, light.quad_area * 3.1416 / 8 * -std::log(0.7), 1e-2 * light.depth);
  EXPECT_FALSE(light.among_particles);
}

TEST(SceneFeatures, AreFiniteWhereParticlesSurroundTheEye) {
  Scene scene = test::BallScene(5000, 64);
  scene.camera = test::LookAt({0, 0, 0.05}, {0, 0, -1}, 64, 64);
  const SceneFeatures features = FeaturesOf(scene);
  EXPECT_TRUE(std::isfinite(features.quad_samples));
  EXPECT_LE(features.quad_samples, 5000.0 * 64 * 64);
  EXPECT_GT(features.quad_samples, 0.0);
}

TEST(SceneFeatures, AreZeroWithoutParticles) {
  Scene scene = test::BallScene(1);
  scene.particles = std::make_shared<ParticleSet>();
  const SceneFeatures features = FeaturesOf(scene);
  EXPECT_EQ(features.quad_samples, 0.0);
  CostModel costs;
  EXPECT_GT(costs.Predict(features, Sliced(16, 64)), 0.0);
}

TEST(CostModel, FindsTheTimesOfAnotherMachine) {
  std::vector<double> deviations;
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    CostModel costs;
    test::Draw draw(seed);
    // One machine, up to fifty times faster; many scenes and settings.
    const double speed = draw.LogUniform(0.02, 2.0);
    for (uint32_t frame = 0; frame < 40; ++frame) {
      const Scene scene = test::RandomScene(100 * seed + frame);
      const SceneFeatures features = FeaturesOf(scene);
      const test::World world(scene, seed);
      const Settings settings = Sliced(16 << (frame % 6), 128 << (frame % 3));
      const double measured = speed * world.Milliseconds(settings);
      if (frame >= 20) {
        deviations.push_back(std::abs(std::log(measured / costs.Predict(features, settings))));
      }
      costs.Learn(features, settings, measured);
    }
  }
  std::sort(deviations.begin(), deviations.end());
  const double median = std::exp(deviations[deviations.size() / 2]);
  const double ninety = std::exp(deviations[deviations.size() * 9 / 10]);
  std::cout << "predicted within a factor of " << median << " (median), " << ninety << " (90 %)\n";
  EXPECT_LT(median, 1.25);
  EXPECT_LT(ninety, 2.1);
}

TEST(CostModel, IsNotRuinedByOutliers) {
  const Scene scene = test::RandomScene(2);
  const SceneFeatures features = FeaturesOf(scene);
  const test::World world(scene, 2);
  const Settings settings = Sliced(128, 256);
  const double truth = world.Milliseconds(settings);
  CostModel costs;
  test::Draw draw(9);
  for (int i = 0; i < 60; ++i) {
    costs.Learn(features, settings, truth * std::exp(0.1 * draw.Normal()));
  }
  EXPECT_NEAR(std::log(costs.Predict(features, settings) / truth), 0.0, 0.1);
  costs.Learn(features, settings, 100.0 * truth);
  costs.Learn(features, settings, std::nan(""));
  costs.Learn(features, settings, 0.0);
  EXPECT_NEAR(std::log(costs.Predict(features, settings) / truth), 0.0, 0.25);
  for (int i = 0; i < 20; ++i) costs.Learn(features, settings, truth);
  EXPECT_NEAR(std::log(costs.Predict(features, settings) / truth), 0.0, 0.05);
}

TEST(CostModel, FollowsAChangeThatStays) {
  const Scene scene = test::RandomScene(2);
  const SceneFeatures features = FeaturesOf(scene);
  const Settings settings = Sliced(128, 256);
  CostModel costs;
  for (int i = 0; i < 30; ++i) costs.Learn(features, settings, 100.0);
  for (int i = 0; i < 40; ++i) costs.Learn(features, settings, 1000.0);
  EXPECT_NEAR(std::log(costs.Predict(features, settings) / 1000.0), 0.0, 0.1);
}

TEST(CostModel, LearnsMeasurementsBySamples) {
  const Scene scene = test::RandomScene(2);
  const SceneFeatures features = FeaturesOf(scene);
  CostModel costs;
  for (int i = 0; i < 20; ++i) costs.LearnMeasurement(features, 1024, 50.0);
  EXPECT_NEAR(costs.PredictMeasurement(features, 1024), 50.0, 5.0);
  EXPECT_GT(costs.PredictMeasurement(features, 4096), costs.PredictMeasurement(features, 1024));
}

}  // namespace
}  // namespace halflight
