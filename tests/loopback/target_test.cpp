// Targets over the wire, with the real renderer: what is promised against the error of every pixel.
// Which settings win is nowhere asserted.

#include <iostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/encode/decoded.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/true_error.h"

namespace halflight::loopback {
namespace {

v1::RenderFrameRequest TargetOf(const Scene& scene, const std::vector<v1::OutputKind>& kinds) {
  v1::RenderFrameRequest request = RequestFor(scene, kinds);
  request.mutable_scene()->clear_shadow();
  return request;
}

class Target : public WireTest {};

// The returned attempt is one of them, and all else in the header is of it.
void ExpectWhole(const v1::FrameHeader& header) {
  int returned = 0;
  for (const v1::TargetAttempt& attempt : header.target().attempts()) {
    EXPECT_GT(attempt.milliseconds(), 0.0);
    EXPECT_GT(attempt.expected_milliseconds(), 0.0);
    if (attempt.returned()) {
      ++returned;
      EXPECT_EQ(attempt.met(), header.target().met());
      EXPECT_EQ(attempt.shadow().ShortDebugString(), header.metadata().shadow().ShortDebugString());
    }
  }
  EXPECT_EQ(returned, 1);
  EXPECT_EQ(header.target().reason().empty(), header.target().met());
}

TEST_F(Target, OfAnErrorIsHonouredAtEveryPixel) {
  const Scene scene = Plume();
  ASSERT_NE(scene.particles, nullptr);
  v1::RenderFrameRequest request = TargetOf(scene, {v1::OUTPUT_KIND_BEAUTY, v1::OUTPUT_KIND_ERROR});
  for (const double goal : {0.1, 0.05, 0.02, 0.01}) {
    request.mutable_target()->set_max_error(goal);
    const auto frame = Render(request, scene);
    const Truth truth(FloatsOf(frame.outputs[0]), FloatsOf(frame.outputs[1]));
    std::cout << "max_error " << goal << ": " << truth.relative_rmse << " in "
              << frame.header.target().attempts_size() << " attempts\n";
    ASSERT_GT(truth.covered, 2000U);
    EXPECT_TRUE(frame.header.target().met()) << frame.header.target().reason();
    EXPECT_LE(truth.relative_rmse, goal);
    EXPECT_NEAR(frame.header.error().relative_rmse().value(), truth.relative_rmse, 1e-9);
    ExpectWhole(frame.header);
  }
}

TEST_F(Target, OfAnErrorIsMetBySlicesAndSamplesToo) {
  const Scene scene = Plume();
  ASSERT_NE(scene.particles, nullptr);
  v1::RenderFrameRequest request =
      TargetOf(scene, {v1::OUTPUT_KIND_DEPTH, v1::OUTPUT_KIND_LIGHT_BUFFER});
  request.mutable_target()->set_max_error(0.3);
  const auto frame = Render(request, scene);
  EXPECT_TRUE(frame.header.target().met()) << frame.header.target().reason();
  EXPECT_LE(frame.header.error().relative_rmse().high(), 0.3);
  EXPECT_GT(frame.header.error().sampled_pixels(), 0U);
  ExpectWhole(frame.header);
}

TEST_F(Target, OfTimeAloneIsMetWithoutMeasuring) {
  const Scene scene = test::BallScene(500, 48);
  v1::RenderFrameRequest request = TargetOf(scene, {v1::OUTPUT_KIND_BEAUTY});
  request.mutable_target()->set_max_time_ms(60000.0);
  const auto frame = Render(request, scene);
  EXPECT_TRUE(frame.header.target().met());
  EXPECT_FALSE(frame.header.has_error());
  ExpectWhole(frame.header);
}

TEST_F(Target, ThatIsImpossibleReturnsTheBestAndSaysSo) {
  const Scene scene = test::BallScene(500, 48);
  v1::RenderFrameRequest request = TargetOf(scene, {});
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY, v1::IMAGE_FORMAT_EXR_HALF);
  request.mutable_target()->set_max_time_ms(0.001);
  const auto frame = Render(request, scene);
  EXPECT_FALSE(frame.header.target().met());
  ExpectWhole(frame.header);
  const auto parts = Decode(frame.outputs[0], "exr");
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].texts.at("halflight:target.met"), "false");
  EXPECT_EQ(parts[0].texts.at("halflight:target.maxTimeMs"), "0.001");
}

TEST_F(Target, OfAPointLightAmongTheParticlesIsMet) {
  Scene scene = test::BallScene(500, 48);
  Light light;
  light.kind = PointLight{{0.1, 0.2, 0.0}};
  scene.lights = {light};
  v1::RenderFrameRequest request = TargetOf(scene, {v1::OUTPUT_KIND_BEAUTY, v1::OUTPUT_KIND_ERROR});
  request.mutable_target()->set_max_error(0.1);
  const auto frame = Render(request, scene);
  const Truth truth(FloatsOf(frame.outputs[0]), FloatsOf(frame.outputs[1]));
  EXPECT_TRUE(frame.header.target().met()) << frame.header.target().reason();
  EXPECT_GT(truth.covered, 500U);
  EXPECT_LE(truth.relative_rmse, 0.1);
}

TEST_F(Target, OfScatteringSizesTheLightBufferThatIsShown) {
  Scene scene = test::BallScene(500, 48);
  scene.material.scattering_spread = 0.2F;
  v1::RenderFrameRequest request =
      TargetOf(scene, {v1::OUTPUT_KIND_BEAUTY, v1::OUTPUT_KIND_LIGHT_BUFFER});
  request.mutable_target()->set_max_error(0.5);
  const auto frame = Render(request, scene);
  EXPECT_TRUE(frame.header.target().met()) << frame.header.target().reason();
  EXPECT_EQ(frame.header.error().compared(), v1::COMPARED_FRAME_WITHOUT_SCATTERING);
  EXPECT_EQ(frame.header.outputs(1).width(), frame.header.metadata().shadow().light_buffer_size());
  ExpectWhole(frame.header);
}

// Both ways of a stream, and frames that wait for the first.
TEST_F(Target, OfASequenceIsMetByEveryFrame) {
  const Scene scene = test::BallScene(500, 48);
  const auto source = [&](uint64_t index) -> absl::StatusOr<client::SequenceFrame> {
    client::SequenceFrame frame{TargetOf(scene, {v1::OUTPUT_KIND_BEAUTY}), std::nullopt};
    frame.particles = Encoded(*test::Ball(500, 1 + index));
    frame.request.mutable_target()->set_max_error(0.2);
    return frame;
  };
  uint64_t taken = 0;
  const absl::Status status =
      client_.RenderSequence(6, source, [&](uint64_t index, const client::RenderedFrame& frame) {
        EXPECT_EQ(index, taken++);
        EXPECT_TRUE(frame.header.target().met()) << frame.header.target().reason();
        EXPECT_LE(frame.header.error().relative_rmse().high(), 0.2);
        return absl::OkStatus();
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(taken, 6U);
}

}  // namespace
}  // namespace halflight::loopback
