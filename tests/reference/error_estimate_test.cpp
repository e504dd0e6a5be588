// Estimated errors against those of the whole image, over many seeds.
#include "renderer/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "renderer/error_map.h"
#include "renderer/reference/evaluator.h"
#include "tests/oracle/oracle.h"
#include "tests/oracle/plume.h"
#include "tests/reference/test_scenes.h"

namespace halflight {
namespace {

using reference::BeautyOf;

struct FrameCase {
  const char* name;
  const char* frame;
  float radius;
  float opacity;
  bool interpolate;
  int slices;
  glm::dvec3 light;
  int size = 160;  // pixels along each side
};

Scene SceneOf(const FrameCase& frame) {
  Scene scene;
  scene.particles =
      oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume." + frame.frame + ".ply");
  scene.material.radius = frame.radius;
  scene.material.opacity = frame.opacity;
  scene.shadow.slices = frame.slices;
  scene.shadow.interpolate = frame.interpolate;
  scene.camera.view_from_world =
      glm::lookAt(glm::dvec3(0.5, 1.5, 4.6), glm::dvec3(0, 1.25, 0), glm::dvec3(0, 1, 0));
  scene.camera.width = scene.camera.height = frame.size;
  scene.camera.window = {0, 0, frame.size, frame.size};
  Light light;
  light.kind = DirectionalLight{glm::normalize(frame.light)};
  scene.lights = {light};
  return scene;
}

// A frame and the whole truth about it.
struct KnownFrame {
  Image beauty;
  std::vector<glm::dvec4> reference;
  double mean_square_error = 0.0;
  double bias = 0.0;
  double reference_mean = 0.0;
  size_t covered = 0;

  KnownFrame(Image image, std::vector<glm::dvec4> exact)
      : beauty(std::move(image)), reference(std::move(exact)) {
    for (size_t i = 0; i < reference.size(); ++i) {
      if (!(beauty.pixels[4 * i + 3] > 0.01)) continue;
      ++covered;
      for (int c = 0; c < 3; ++c) {
        const double error =
            static_cast<double>(beauty.pixels[4 * i + static_cast<size_t>(c)]) - reference[i][c];
        mean_square_error += error * error;
        bias += error;
        reference_mean += reference[i][c];
      }
    }
    for (double* sum : {&mean_square_error, &bias, &reference_mean}) {
      *sum /= 3.0 * static_cast<double>(covered);
    }
  }

  [[nodiscard]] ErrorEstimate Estimate(const ErrorEstimateOptions& options) const {
    const ReferenceAt at =
        [this](std::span<const glm::ivec2> pixels) -> absl::StatusOr<std::vector<glm::dvec4>> {
      std::vector<glm::dvec4> values;
      for (const glm::ivec2& pixel : pixels) {
        values.push_back(
            reference[static_cast<size_t>(pixel.y) * static_cast<size_t>(beauty.width) +
                      static_cast<size_t>(pixel.x)]);
      }
      return values;
    };
    absl::StatusOr<ErrorEstimate> estimate = EstimateError(beauty, at, options);
    EXPECT_TRUE(estimate.ok()) << estimate.status();
    return *estimate;
  }
};

// Of one figure, over seeds: how often its interval held, and the mean of its estimates.
class Tally {
 public:
  explicit Tally(double truth) : truth_(truth) {}

  void Add(const EstimatedFigure& figure) {
    ++count_;
    held_ += figure.low <= truth_ && truth_ <= figure.high ? 1 : 0;
    sum_ += figure.value;
    squares_ += (figure.value - truth_) * (figure.value - truth_);
  }

  [[nodiscard]] double coverage() const { return held_ / count_; }
  // How far the mean of the estimates is from the truth, in its own standard errors.
  [[nodiscard]] double deviation() const {
    return (sum_ / count_ - truth_) / std::sqrt(squares_ / count_ / count_);
  }

 private:
  double truth_;
  double count_ = 0.0;
  double held_ = 0.0;
  double sum_ = 0.0;
  double squares_ = 0.0;
};

class ErrorEstimateOf : public testing::TestWithParam<FrameCase> {};

TEST_P(ErrorEstimateOf, IsUnbiasedAndItsIntervalsHold) {
  const Scene scene = SceneOf(GetParam());
  ASSERT_NE(scene.particles, nullptr);
  const auto exact = (*reference::Evaluator::Create(scene))->EvaluateWindow();
  ASSERT_TRUE(exact.ok());
  const KnownFrame frame(BeautyOf(oracle::RenderHalfAngle(scene).rgba, GetParam().size),
                         exact->rgba);
  const double relative = std::sqrt(frame.mean_square_error) / frame.reference_mean;
  Tally square(frame.mean_square_error);
  Tally bias(frame.bias);
  Tally rmse(std::sqrt(frame.mean_square_error));
  Tally relative_rmse(relative);
  constexpr int kSeeds = 3000;  // a coverage of 0.95 is then known to 0.004
  for (int seed = 0; seed < kSeeds; ++seed) {
    const ErrorEstimate estimate = frame.Estimate({.seed = static_cast<uint64_t>(seed)});
    ASSERT_EQ(estimate.covered_pixels, frame.covered);
    ASSERT_EQ(estimate.sampled_pixels, 1024U);
    square.Add(estimate.mean_square_error);
    bias.Add(estimate.bias);
    rmse.Add(estimate.rmse);
    relative_rmse.Add(estimate.relative_rmse);
  }
  std::cout << GetParam().name << ": relative RMSE " << relative << ", deviation of MSE "
            << square.deviation() << ", of bias " << bias.deviation() << ", coverage of MSE "
            << square.coverage() << ", bias " << bias.coverage() << ", relative RMSE "
            << relative_rmse.coverage() << "\n";
  RecordProperty("coverage_mse", std::to_string(square.coverage()));
  RecordProperty("coverage_bias", std::to_string(bias.coverage()));
  EXPECT_LT(std::abs(square.deviation()), 3.5);
  EXPECT_LT(std::abs(bias.deviation()), 3.5);
  for (const Tally* tally : {&square, &bias, &rmse, &relative_rmse}) {
    EXPECT_GE(tally->coverage(), 0.93);
    EXPECT_LE(tally->coverage(), 0.97);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Frames, ErrorEstimateOf,
    testing::Values(
        FrameCase{"DenseInterpolated", "0040", 0.045F, 0.18F, true, 128, {1, -0.6, -0.6}},
        FrameCase{"DensePlain", "0040", 0.045F, 0.18F, false, 64, {1, -0.6, -0.6}},
        FrameCase{"ThinInterpolated", "0024", 0.045F, 0.02F, true, 32, {0.3, -0.4, 1}},
        FrameCase{"ThinPlain", "0024", 0.045F, 0.02F, false, 32, {-0.2, -0.3, -1}},
        FrameCase{"OpaqueFlipped", "0040", 0.03F, 0.5F, false, 128, {1, -0.2, 0.3}},
        FrameCase{"NearlyRight", "0032", 0.045F, 0.18F, true, 512, {0.3, -0.4, 1}},
        // Few of many pixels, and most of the error in few of them.
        FrameCase{"LargeNearlyRight", "0032", 0.07F, 0.18F, true, 512, {0.3, -0.4, 1}, 400}),
    [](const auto& param) { return std::string(param.param.name); });

// A frame of a gradient whose error is known at every pixel.
KnownFrame MadeUpFrame(int width, int height) {
  std::vector<glm::dvec4> exact;
  std::vector<glm::dvec4> drawn;
  for (int i = 0; i < width * height; ++i) {
    const double value = static_cast<double>(i % width) / width;
    exact.emplace_back(value, 0.5 * value, 0.2, value);
    drawn.push_back(exact.back() + glm::dvec4(0.01 * value, -0.02, 0.0, 0.0));
  }
  return {BeautyOf(drawn, width), exact};
}

TEST(ErrorEstimate, OfFewPixelsIsExact) {
  const KnownFrame frame = MadeUpFrame(20, 20);
  const ErrorEstimate estimate = frame.Estimate({});
  EXPECT_EQ(estimate.sampled_pixels, frame.covered);
  EXPECT_LT(frame.covered, 400U);  // the first column is not covered
  EXPECT_NEAR(estimate.mean_square_error.value, frame.mean_square_error, 1e-12);
  EXPECT_NEAR(estimate.bias.value, frame.bias, 1e-12);
  EXPECT_NEAR(estimate.reference_mean, frame.reference_mean, 1e-12);
  EXPECT_EQ(estimate.mean_square_error.low, estimate.mean_square_error.high);
  EXPECT_EQ(estimate.relative_rmse.low, estimate.relative_rmse.high);
}

TEST(ErrorEstimate, TakesDifferentPixelsForDifferentSeedsAndTheSameForTheSame) {
  const KnownFrame frame = MadeUpFrame(64, 64);
  const double first = frame.Estimate({.samples = 64, .seed = 1}).mean_square_error.value;
  EXPECT_EQ(frame.Estimate({.samples = 64, .seed = 1}).mean_square_error.value, first);
  EXPECT_NE(frame.Estimate({.samples = 64, .seed = 2}).mean_square_error.value, first);
}

TEST(ErrorEstimate, NoPixelIsTakenTwiceAndNoneThatIsNotCovered) {
  const KnownFrame frame = MadeUpFrame(32, 32);
  std::set<std::pair<int, int>> seen;
  const ReferenceAt at =
      [&](std::span<const glm::ivec2> pixels) -> absl::StatusOr<std::vector<glm::dvec4>> {
    for (const glm::ivec2& pixel : pixels) {
      EXPECT_TRUE(seen.emplace(pixel.x, pixel.y).second);
      EXPECT_GT(pixel.x, 0);
    }
    return std::vector<glm::dvec4>(pixels.size());
  };
  ASSERT_TRUE(EstimateError(frame.beauty, at, {.samples = 512, .seed = 5}).ok());
  EXPECT_EQ(seen.size(), 512U);
}

TEST(ErrorEstimate, NamesTheWorstPixelOfTheSample) {
  KnownFrame frame = MadeUpFrame(20, 20);
  frame.beauty.pixels[4 * (7 * 20 + 11) + 1] += 0.5F;
  const ErrorEstimate estimate = frame.Estimate({});
  ASSERT_FALSE(estimate.sample_worst.empty());
  EXPECT_EQ(estimate.sample_worst[0].pixel, glm::ivec2(11, 7));
  EXPECT_NEAR(estimate.sample_worst[0].largest, 0.48, 1e-6);
  EXPECT_EQ(estimate.sample_max, estimate.sample_worst[0].largest);
  EXPECT_LT(estimate.sample_p999, 0.48);
  EXPECT_LE(estimate.sample_worst[1].largest, estimate.sample_worst[0].largest);
}

TEST(ErrorEstimate, OfTheReferenceItselfIsRoundingAlone) {
  Scene scene = reference::RandomScene(60, 48);
  scene.lights.resize(1);
  const auto exact = (*reference::Evaluator::Create(scene))->EvaluateWindow();
  const absl::StatusOr<ErrorEstimate> estimate = EstimateError(BeautyOf(exact->rgba, 48), scene);
  ASSERT_TRUE(estimate.ok());
  EXPECT_GT(estimate->sampled_pixels, 100U);
  EXPECT_LT(estimate->sample_max, 1e-6);
}

TEST(ErrorEstimate, OfAnEmptyFrameIsNothing) {
  const ErrorEstimate estimate =
      KnownFrame(BeautyOf(std::vector<glm::dvec4>(9), 3), std::vector<glm::dvec4>(9)).Estimate({});
  EXPECT_EQ(estimate.covered_pixels, 0U);
  EXPECT_EQ(estimate.rmse.value, 0.0);
}

TEST(ErrorEstimate, OfABlackModelIsInfiniteAndOfAFrameThatIsNotFiniteToo) {
  const std::vector<glm::dvec4> black(400, glm::dvec4(0.0, 0.0, 0.0, 1.0));
  const ErrorEstimate none = KnownFrame(BeautyOf(black, 20), black).Estimate({});
  EXPECT_EQ(none.relative_rmse.high, 0.0);
  const std::vector<glm::dvec4> grey(400, glm::dvec4(0.5, 0.5, 0.5, 1.0));
  const ErrorEstimate wrong = KnownFrame(BeautyOf(grey, 20), black).Estimate({});
  EXPECT_EQ(wrong.rmse.value, 0.5);
  EXPECT_EQ(wrong.relative_rmse.value, HUGE_VAL);

  KnownFrame broken = MadeUpFrame(64, 64);
  broken.beauty.pixels[4 * 100] = NAN;
  broken.beauty.pixels[4 * 200] = INFINITY;
  const Image map{64, 64, 1, {"R", "G", "B"}, std::vector<float>(3 * 64 * 64, NAN)};
  for (const ErrorEstimate& estimate :
       {broken.Estimate({.samples = 8192}), ErrorOf(broken.beauty, map)}) {
    EXPECT_FALSE(estimate.relative_rmse.high <= 1.0) << "it must not pass for a good frame";
    EXPECT_EQ(estimate.sample_max, HUGE_VAL);
  }
}

TEST(ErrorEstimate, RefusesTooFewSamplesAndIsCancelled) {
  const KnownFrame frame = MadeUpFrame(20, 20);
  Scene scene = reference::RandomScene(60, 20);
  EXPECT_EQ(EstimateError(frame.beauty, scene, {.samples = 31}).status().code(),
            absl::StatusCode::kInvalidArgument);
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(EstimateError(frame.beauty, scene, {}, source.get_token()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace halflight
