// The error at every pixel, and the figures made of it, against the model and against the estimate.
#include "renderer/error_map.h"

#include <stop_token>

#include <gtest/gtest.h>

#include "renderer/reference/evaluator.h"
#include "tests/reference/test_scenes.h"

namespace halflight {
namespace {

TEST(ErrorMap, IsFrameMinusModelAndSaysWhatAllSamplesSay) {
  constexpr int kSize = 300;  // more pixels than are done at a time
  Scene scene = reference::RandomScene(60, kSize);
  scene.lights.resize(1);
  const auto exact = (*reference::Evaluator::Create(scene))->EvaluateWindow();
  Image beauty = reference::BeautyOf(exact->rgba, kSize);
  for (size_t i = 0; i < beauty.pixels.size(); ++i) {
    if (i % 4 != 3) beauty.pixels[i] += 1e-3F * static_cast<float>(i % 17) - 5e-3F;
  }
  const absl::StatusOr<Image> map = ErrorMap(beauty, scene);
  ASSERT_TRUE(map.ok()) << map.status();
  ASSERT_EQ(map->pixels.size(), size_t{3} * kSize * kSize);
  for (size_t i = 0; i < exact->rgba.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<size_t>(c);
      ASSERT_EQ(map->pixels[3 * i + channel],
                static_cast<float>(static_cast<double>(beauty.pixels[4 * i + channel]) -
                                   exact->rgba[i][c]));
    }
  }

  const ErrorEstimate by_map = ErrorOf(beauty, *map);
  const absl::StatusOr<ErrorEstimate> sampled = EstimateError(beauty, scene, {.samples = 1000000});
  ASSERT_TRUE(sampled.ok()) << sampled.status();
  EXPECT_GT(by_map.covered_pixels, 1000U);
  EXPECT_EQ(by_map.covered_pixels, sampled->covered_pixels);
  EXPECT_EQ(by_map.sampled_pixels, sampled->sampled_pixels);
  for (const auto figure : {&ErrorEstimate::mean_square_error, &ErrorEstimate::bias,
                            &ErrorEstimate::rmse, &ErrorEstimate::relative_rmse}) {
    EXPECT_NEAR((by_map.*figure).value, ((*sampled).*figure).value, 1e-7);
    EXPECT_EQ((by_map.*figure).low, (by_map.*figure).high);
  }
  EXPECT_NEAR(by_map.reference_mean, sampled->reference_mean, 1e-7);
  EXPECT_NEAR(by_map.sample_p999, sampled->sample_p999, 1e-7);
  EXPECT_NEAR(by_map.sample_max, sampled->sample_max, 1e-7);
  ASSERT_EQ(by_map.sample_worst.size(), sampled->sample_worst.size());
  for (size_t i = 0; i < by_map.sample_worst.size(); ++i) {
    EXPECT_NEAR(by_map.sample_worst[i].largest, sampled->sample_worst[i].largest, 1e-7);
  }
}

TEST(ErrorMap, OfAFrameWithoutParticlesIsTheFrame) {
  const Scene scene = reference::EmptyScene(4);
  const Image beauty = reference::BeautyOf(std::vector<glm::dvec4>(16, glm::dvec4(0.25)), 4);
  const absl::StatusOr<Image> map = ErrorMap(beauty, scene);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->pixels, std::vector<float>(48, 0.25F));
  const Image nothing = reference::BeautyOf(std::vector<glm::dvec4>(16), 4);
  EXPECT_EQ(ErrorOf(nothing, *map).covered_pixels, 0U);
  EXPECT_EQ(ErrorOf(nothing, *map).relative_rmse.value, 0.0);
}

TEST(ErrorMap, IsCancelled) {
  std::stop_source source;
  source.request_stop();
  const Image beauty = reference::BeautyOf(std::vector<glm::dvec4>(400), 20);
  EXPECT_EQ(ErrorMap(beauty, reference::RandomScene(60, 20), source.get_token()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace halflight
