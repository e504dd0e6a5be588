// Stated errors against the truth, over the wire, with the real renderer: the plume drawn by
// half-angle slicing, the reference itself, an empty image, scattering, downsampling.

#include <cmath>
#include <iostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/encode/decoded.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/true_error.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

class MeasuredError : public WireTest {};

bool Holds(const v1::EstimatedFigure& figure, double truth) {
  return figure.low() <= truth && truth <= figure.high();
}

TEST_F(MeasuredError, IntervalsOfThePlumeHoldTheTrueOne) {
  const Scene scene = Plume();
  ASSERT_NE(scene.particles, nullptr);
  const auto whole =
      Render(RequestFor(scene, {v1::OUTPUT_KIND_BEAUTY, v1::OUTPUT_KIND_ERROR}), scene);
  const std::vector<float> beauty = FloatsOf(whole.outputs[0]);
  const Truth truth(beauty, FloatsOf(whole.outputs[1]));
  ASSERT_GT(truth.covered, 2000U);
  EXPECT_GT(truth.relative_rmse, 0.01) << "half-angle slicing is not that good";
  EXPECT_EQ(whole.header.error().sampled_pixels(), truth.covered);
  EXPECT_NEAR(whole.header.error().relative_rmse().value(), truth.relative_rmse, 1e-9);

  // Of a hundred intervals five miss: three of eight do once in two hundred times.
  constexpr uint64_t kSeeds = 8;
  constexpr int kLeastHolding = 6;
  v1::RenderFrameRequest request = RequestFor(scene, {v1::OUTPUT_KIND_BEAUTY});
  int holding[4] = {};
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    request.mutable_measure_error()->set_seed(seed);
    const auto sampled = Render(request, scene);
    EXPECT_EQ(FloatsOf(sampled.outputs[0]), beauty) << "measuring does not change the frame";
    const v1::MeasuredError& error = sampled.header.error();
    std::cout << "relative RMSE " << truth.relative_rmse << ", measured "
              << error.relative_rmse().ShortDebugString() << "\n";
    EXPECT_EQ(error.compared(), v1::COMPARED_FRAME_RETURNED);
    EXPECT_EQ(error.covered_pixels(), truth.covered);
    EXPECT_EQ(error.sampled_pixels(), 1024U);
    EXPECT_LT(error.relative_rmse().high(), 1.5 * error.relative_rmse().low());
    EXPECT_LE(error.sample_max(), truth.max + 1e-6);
    holding[0] += Holds(error.mean_square_error(), truth.mse) ? 1 : 0;
    holding[1] += Holds(error.bias(), truth.bias) ? 1 : 0;
    holding[2] += Holds(error.rmse(), std::sqrt(truth.mse)) ? 1 : 0;
    holding[3] += Holds(error.relative_rmse(), truth.relative_rmse) ? 1 : 0;
  }
  for (const int held : holding) EXPECT_GE(held, kLeastHolding);

  // Two ways to the same figures: the map's pixels, and samples of all of them.
  request.mutable_measure_error()->set_samples(1048576);
  const v1::MeasuredError all = Render(request, scene).header.error();
  EXPECT_EQ(all.sampled_pixels(), truth.covered);
  EXPECT_NEAR(all.relative_rmse().value(), truth.relative_rmse, 1e-6);
  EXPECT_NEAR(all.bias().value(), truth.bias, 1e-6);
  EXPECT_NEAR(all.sample_max(), truth.max, 1e-6);
}

TEST_F(MeasuredError, OfTheReferenceIsRoundingAlone) {
  Scene scene = test::BallScene(300, 48);
  v1::RenderFrameRequest request =
      RequestFor(scene, {v1::OUTPUT_KIND_BEAUTY, v1::OUTPUT_KIND_ERROR});
  request.mutable_scene()->mutable_shadow()->set_technique(v1::SHADOW_TECHNIQUE_REFERENCE);
  const auto map = Render(request, scene);
  for (const float off : FloatsOf(map.outputs[1])) {
    EXPECT_LT(std::abs(off), 1e-6F);
  }
  request.mutable_outputs()->RemoveLast();
  request.mutable_measure_error();
  const v1::MeasuredError error = Render(request, scene).header.error();
  EXPECT_GT(error.sampled_pixels(), 500U);
  EXPECT_LT(error.relative_rmse().high(), 1e-6);
  EXPECT_LT(error.sample_max(), 1e-6);
}

TEST_F(MeasuredError, OfAnEmptyImageIsZero) {
  Scene scene = test::BallScene(300, 48);
  scene.camera = test::LookAt({0, 0, 4}, {0, 0, 8}, 48, 48);
  v1::RenderFrameRequest request = RequestFor(scene, {v1::OUTPUT_KIND_BEAUTY});
  request.mutable_measure_error();
  for (const bool map : {false, true}) {
    if (map) {
      *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_ERROR);
    }
    const auto frame = Render(request, scene);
    const v1::MeasuredError& error = frame.header.error();
    EXPECT_TRUE(frame.header.has_error());
    EXPECT_EQ(error.covered_pixels(), 0U);
    EXPECT_EQ(error.relative_rmse().high(), 0.0);
    EXPECT_EQ(error.sample_worst_size(), 0);
  }
}

TEST_F(MeasuredError, OfScatteringIsThatOfTheFrameWithout) {
  Scene scene = test::BallScene(300, 48);
  v1::RenderFrameRequest plain = RequestFor(scene, {v1::OUTPUT_KIND_BEAUTY, v1::OUTPUT_KIND_ERROR});
  const auto without = Render(plain, scene);
  scene.material.scattering_spread = 0.3F;
  const auto with =
      Render(RequestFor(scene, {v1::OUTPUT_KIND_BEAUTY, v1::OUTPUT_KIND_ERROR}), scene);
  EXPECT_NE(with.outputs[0], without.outputs[0]);
  EXPECT_EQ(with.outputs[1], without.outputs[1]);
  EXPECT_EQ(with.header.error().compared(), v1::COMPARED_FRAME_WITHOUT_SCATTERING);
  EXPECT_EQ(without.header.error().compared(), v1::COMPARED_FRAME_RETURNED);
  EXPECT_EQ(with.header.error().rmse().value(), without.header.error().rmse().value());
}

TEST_F(MeasuredError, CountsWhatDownsamplingLoses) {
  Scene scene = test::BallScene(300, 48);
  v1::RenderFrameRequest request = RequestFor(scene, {v1::OUTPUT_KIND_BEAUTY});
  request.mutable_measure_error();
  const double full = Render(request, scene).header.error().relative_rmse().value();
  request.mutable_scene()->mutable_sampling()->set_downsample(4);
  const v1::MeasuredError coarse = Render(request, scene).header.error();
  EXPECT_GT(coarse.relative_rmse().low(), full);
  EXPECT_LT(coarse.relative_rmse().high(), 1.0);
}

TEST_F(MeasuredError, IsInTheFilesAndPlacedInTheCrop) {
  Scene scene = test::BallScene(300, 64);
  scene.camera.window = {16, 24, 32, 20};
  v1::RenderFrameRequest request = RequestFor(scene, {v1::OUTPUT_KIND_ERROR});
  request.clear_outputs();
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY, v1::IMAGE_FORMAT_EXR_HALF);
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY, v1::IMAGE_FORMAT_PNG8);
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_ERROR);
  const auto frame = Render(request, scene);
  const v1::MeasuredError& error = frame.header.error();
  for (const auto& [bytes, format] :
       {std::pair(frame.outputs[0], "exr"), std::pair(frame.outputs[1], "png")}) {
    const auto parts = Decode(bytes, format);
    ASSERT_EQ(parts.size(), 1U);
    const auto& texts = parts[0].texts;
    ASSERT_EQ(texts.count("halflight:error.relativeRmse"), 1U);
    EXPECT_NEAR(std::stod(texts.at("halflight:error.relativeRmse")), error.relative_rmse().value(),
                1e-5);
    EXPECT_EQ(texts.at("halflight:error.compared"), "COMPARED_FRAME_RETURNED");
  }
  const std::vector<float> map = FloatsOf(frame.outputs[2]);
  ASSERT_EQ(map.size(), 3U * 32U * 20U);
  ASSERT_GT(error.sample_worst_size(), 0);
  for (const v1::PixelError& worst : error.sample_worst()) {
    EXPECT_EQ(static_cast<float>(worst.g()), map.at(3 * (worst.y() * 32 + worst.x()) + 1));
  }
}

}  // namespace
}  // namespace halflight::loopback
