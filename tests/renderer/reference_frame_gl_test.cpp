// The reference as a technique of frames: its images, its plan, and what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stop_token>
#include <string>

#include "renderer/reference/evaluator.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using ::testing::HasSubstr;

Scene ReferenceScene() {
  Scene scene = test::BallScene(500, 24);
  scene.shadow.technique = ShadowTechniqueKind::kReference;
  return scene;
}

class ReferenceFrame : public test::GlTest {};

TEST_F(ReferenceFrame, ShowsWhatTheEvaluatorSays) {
  Scene scene = ReferenceScene();
  scene.lights[0].shadow_density = {1.0F, 0.5F, 2.0F};
  scene.sampling.supersample = 2;
  const FrameResult frame = Render({scene,
                                    {{ImageKind::kBeauty},
                                     {ImageKind::kCoverage},
                                     {ImageKind::kDepth},
                                     {ImageKind::kLightTransmittance}}});
  const auto values = (*reference::Evaluator::Create(scene))->EvaluateWindow();
  ASSERT_TRUE(values.ok());
  ASSERT_EQ(frame.images.size(), 4U);
  for (int i = 0; i < 24 * 24; ++i) {
    const auto k = static_cast<size_t>(i);
    for (int c = 0; c < 4; ++c) {
      EXPECT_EQ(test::PixelAt(frame.images[0], i % 24, i / 24)[c],
                static_cast<float>(values->rgba[k][c]));
    }
    EXPECT_EQ(frame.images[1].pixels[k], static_cast<float>(values->rgba[k].a));
    EXPECT_EQ(frame.images[2].pixels[k], static_cast<float>(values->depth[k]));
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(test::PixelAt(frame.images[3], i % 24, i / 24)[c],
                static_cast<float>(values->transmittance[0][k][c]));
    }
  }
}

TEST_F(ReferenceFrame, IsOnePassAndOneStage) {
  const FrameResult frame = Render(test::Beauty(ReferenceScene()));
  ASSERT_EQ(frame.plan.passes.size(), 1U);
  EXPECT_EQ(frame.plan.passes[0].name, "evaluate the image model in float64");
  EXPECT_TRUE(frame.plan.traversals.empty());
  ASSERT_EQ(frame.lights.size(), 1U);
  EXPECT_TRUE(frame.lights[0].casts_shadows);
  std::vector<std::string> stages;
  for (const StageTiming& timing : frame.timings) stages.push_back(timing.stage);
  EXPECT_THAT(stages, ::testing::Contains("reference"));
  EXPECT_THAT(stages, ::testing::Not(::testing::Contains("upload")));
}

TEST_F(ReferenceFrame, HalfAngleSlicingComesNearIt) {
  Scene scene = ReferenceScene();
  const Image exact = RenderBeauty(scene);
  scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  scene.shadow.slices = 256;
  scene.shadow.light_buffer_size = 512;
  const Image sliced = RenderBeauty(scene);
  double squares = 0.0;
  double sum = 0.0;
  for (size_t i = 0; i < exact.pixels.size(); ++i) {
    squares += std::pow(static_cast<double>(sliced.pixels[i]) - exact.pixels[i], 2);
    sum += exact.pixels[i];
  }
  const auto count = static_cast<double>(exact.pixels.size());
  const double relative = std::sqrt(squares / count) / (sum / count);
  RecordProperty("relative_rmse", std::to_string(relative));
  EXPECT_LT(relative, 0.15);
  EXPECT_GT(relative, 0.0);
}

TEST_F(ReferenceFrame, LightsAPointAmongTheParticles) {
  Scene scene = ReferenceScene();
  scene.lights[0].kind = PointLight{{0.1, 0.1, 0.1}, true};
  EXPECT_GT(test::PixelAt(RenderBeauty(scene), 12, 12)[0], 0.0F);
}

TEST_F(ReferenceFrame, RefusesByNameWhatTheModelHasNot) {
  struct Refusal {
    std::function<void(FrameRequest&)> change;
    std::string message;
  };
  const std::vector<Refusal> refusals = {
      {[](FrameRequest& r) { r.images = {{ImageKind::kLightBuffer}}; }, "outputs: light buffer, "},
      {[](FrameRequest& r) { r.images = {{ImageKind::kLightLayers}}; }, "outputs: light layers, "},
      {[](FrameRequest& r) { r.scene.sampling.downsample = 2; }, "sampling.downsample: 2, "},
      {[](FrameRequest& r) { r.scene.material.scattering_spread = 0.5F; },
       "material.scattering_spread: 0.5, "},
      {[](FrameRequest& r) {
         r.scene.material.physical_scattering = {0.5F, 0.75F};
       },
       "material.physical_scattering.albedo: 0.75, "},
      {[](FrameRequest& r) {
         r.scene.shadow.blur_mode = BlurMode::kTexelsPerSlice;
         r.scene.shadow.blur_texels = 2.0F;
       },
       "shadow.blur_texels: 2, "}};
  for (const Refusal& refusal : refusals) {
    FrameRequest request = test::Beauty(ReferenceScene());
    refusal.change(request);
    const absl::Status status = Renderer().Render(request, {}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()),
                HasSubstr(refusal.message + "allowed under technique REFERENCE: "));
  }
}

TEST_F(ReferenceFrame, IsCancelled) {
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(Renderer().Render(test::Beauty(ReferenceScene()), source.get_token()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace halflight
