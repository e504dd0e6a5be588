// A plan lists what the request needs, and nothing else.
#include "renderer/frame_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "renderer/techniques/half_angle_light.h"
#include "tests/renderer/test_scene.h"

namespace halflight {
namespace {

using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

FramePlan Plan(const FrameRequest& request) {
  return *PlanFrame(request, ParticleView(request.scene));
}

auto PassNamed(const char* name) { return Field(&PlannedPass::name, HasSubstr(name)); }

TEST(PlanFrame, WithoutShadowsHasOneWalkByDistanceAndNoLightBuffer) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  request.scene.lights = {test::Sun({0, -1, 0}, 0.0F), test::Sun({1, 0, 0}, 0.0F)};
  const FramePlan plan = Plan(request);
  ASSERT_EQ(plan.traversals.size(), 1U);
  EXPECT_FALSE(plan.traversals[0].axis.has_value());
  EXPECT_EQ(plan.traversals[0].light_buffer_size, 0);
  EXPECT_EQ(plan.traversals[0].unshadowed_lights, (std::vector<int>{0, 1}));
  EXPECT_THAT(plan.passes, Not(Contains(PassNamed("light"))));
}

TEST(PlanFrame, WalksOnceForEachLightThatCastsShadowsAndAddsTheRestToTheFirst) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  request.scene.lights = {test::Sun({1, 0, 0}, 0.0F), test::Sun({0, -1, 0}),
                          test::Sun({0, 0, -1}, 2.0F)};
  const FramePlan plan = Plan(request);
  ASSERT_EQ(plan.traversals.size(), 2U);
  EXPECT_EQ(plan.traversals[0].shadow_light, 1);
  EXPECT_EQ(plan.traversals[1].shadow_light, 2);
  EXPECT_EQ(plan.traversals[0].unshadowed_lights, std::vector<int>{0});
  EXPECT_THAT(plan.traversals[1].unshadowed_lights, IsEmpty());
  EXPECT_TRUE(plan.traversals[0].ambient_and_emission);
  EXPECT_FALSE(plan.traversals[1].ambient_and_emission);
}

TEST(PlanFrame, BlursOnlyWhereLightScatters) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  EXPECT_FALSE(Plan(request).traversals[0].blur);
  EXPECT_THAT(Plan(request).passes, Not(Contains(PassNamed("blur"))));
  request.scene.material.scattering_spread = 0.1F;
  EXPECT_TRUE(Plan(request).traversals[0].blur);
  EXPECT_THAT(Plan(request).passes, Contains(PassNamed("blur")));
}

TEST(PlanFrame, KeepsUnscatteredLightOnlyWhereAPhysicalMediumScatters) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  request.scene.material.scattering_spread = 0.1F;
  EXPECT_FALSE(Plan(request).traversals[0].keep_unscattered);
  request.scene.material.scattering_spread = 0.0F;
  request.scene.material.physical_scattering = PhysicalScattering{0.8F, 0.9F};
  EXPECT_TRUE(Plan(request).traversals[0].keep_unscattered);
  EXPECT_THAT(Plan(request).passes, Contains(PassNamed("blur")));
  // A medium that only absorbs.
  request.scene.material.physical_scattering->albedo = 0.0F;
  EXPECT_FALSE(Plan(request).traversals[0].keep_unscattered);
  EXPECT_THAT(Plan(request).passes, Not(Contains(PassNamed("blur"))));
}

TEST(PlanFrame, ColoursTheLightBufferOnlyWhereBlurTreatsColoursDifferently) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  request.scene.lights[0].shadow_density = {1.0F, 2.0F, 3.0F};
  EXPECT_FALSE(Plan(request).traversals[0].colored_light_buffer);
  request.scene.material.scattering_spread = 0.1F;
  EXPECT_TRUE(Plan(request).traversals[0].colored_light_buffer);
  request.scene.lights[0].shadow_density = glm::vec3(2.0F);
  EXPECT_FALSE(Plan(request).traversals[0].colored_light_buffer);
}

TEST(PlanFrame, CopiesTheLightBufferOnlyToInterpolate) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  EXPECT_THAT(Plan(request).passes, Contains(PassNamed("copy light buffer")));
  request.scene.shadow.interpolate = false;
  EXPECT_THAT(Plan(request).passes, Not(Contains(PassNamed("copy light buffer"))));
}

TEST(PlanFrame, NamesWhatComposites) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  for (const bool shadows : {true, false}) {
    if (!shadows) request.scene.lights[0].shadow_density = glm::vec3(0.0F);
    request.scene.shadow.compositor = SliceCompositor::kRaster;
    EXPECT_THAT(Plan(request).passes, Contains(PassNamed("composite")));
    EXPECT_THAT(Plan(request).passes, Not(Contains(PassNamed("in tiles"))));
    request.scene.shadow.compositor = SliceCompositor::kTiles;
    EXPECT_THAT(Plan(request).passes, Contains(PassNamed("composite slices in tiles")));
    EXPECT_THAT(Plan(request).passes, Not(Contains(PassNamed("copy light buffer"))));
  }
}

TEST(PlanFrame, KeepsOnlyWhatOutputsShow) {
  FrameRequest request = test::Beauty(test::BallScene(100));
  FramePlan plan = Plan(request);
  EXPECT_FALSE(plan.keep_depth);
  EXPECT_FALSE(plan.traversals[0].keep_transmittance);
  EXPECT_FALSE(plan.traversals[0].keep_light_buffer);
  EXPECT_FALSE(plan.traversals[0].keep_layers);
  request.images = {{ImageKind::kDepth},
                    {ImageKind::kLightTransmittance},
                    {ImageKind::kLightBuffer},
                    {ImageKind::kLightLayers}};
  plan = Plan(request);
  EXPECT_TRUE(plan.keep_depth);
  EXPECT_TRUE(plan.traversals[0].keep_transmittance);
  EXPECT_TRUE(plan.traversals[0].keep_light_buffer);
  EXPECT_TRUE(plan.traversals[0].keep_layers);
}

TEST(PlanFrame, ResolvesOnlyWhereSamplesAreNotPixels) {
  FrameRequest request = test::Beauty(test::BallScene(100, 99));
  EXPECT_EQ(Plan(request).composite_size, glm::ivec2(99));
  request.scene.sampling = {.supersample = 3, .downsample = 1};
  EXPECT_EQ(Plan(request).composite_size, glm::ivec2(297));
  EXPECT_THAT(Plan(request).passes, Contains(PassNamed("average")));
  request.scene.sampling = {.supersample = 1, .downsample = 2};
  EXPECT_EQ(Plan(request).composite_size, glm::ivec2(50));
  EXPECT_THAT(Plan(request).passes, Contains(PassNamed("enlarge")));
}

TEST(PlanFrame, NeverPlansMoreSlicesThanParticles) {
  FrameRequest request = test::Beauty(test::BallScene(5));
  EXPECT_EQ(Plan(request).traversals[0].slices, 5);
}

TEST(PlanFrame, RefusesMoreLightsThanTheShaderHoldsByName) {
  FrameRequest request = test::Beauty(test::BallScene(5));
  request.scene.lights.assign(kMaxLights, test::Sun({0, -1, 0}, 0.0F));
  EXPECT_TRUE(PlanFrame(request, ParticleView(request.scene)).ok());
  request.scene.lights.push_back(test::Sun({0, -1, 0}));
  const auto plan = PlanFrame(request, ParticleView(request.scene));
  EXPECT_EQ(plan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(plan.status().message()), HasSubstr("lighting.lights: 17 lights"));
}

TEST(HalfAngleAxis, LiesBetweenViewAndLightAndIsDrawnFrontToBackWhenTheyAgree) {
  const HalfAngleAxis axis = ComputeHalfAngleAxis({0, 0, -1}, {1, 0, 0.001});
  EXPECT_TRUE(axis.back_to_front);
  const HalfAngleAxis agreeing = ComputeHalfAngleAxis({0, 0, -1}, {1, 0, -0.001});
  EXPECT_FALSE(agreeing.back_to_front);
  EXPECT_NEAR(agreeing.axis.x, std::sqrt(0.5), 1e-3);
  EXPECT_NEAR(agreeing.axis.z, -std::sqrt(0.5), 1e-3);
}

TEST(HalfAngleAxis, IsTheLightItselfWhenParallelOrAntiparallelToTheView) {
  EXPECT_EQ(ComputeHalfAngleAxis({0, 0, -1}, {0, 0, -1}).axis, glm::dvec3(0, 0, -1));
  EXPECT_EQ(ComputeHalfAngleAxis({0, 0, -1}, {0, 0, 1}).axis, glm::dvec3(0, 0, 1));
  EXPECT_TRUE(ComputeHalfAngleAxis({0, 0, -1}, {0, 0, 1}).back_to_front);
}

TEST(HalfAngleAxis, AlwaysAscendsAwayFromTheLight) {
  for (int degrees = 0; degrees <= 180; ++degrees) {
    const double angle = degrees * test::kDegree;
    const glm::dvec3 light(std::sin(angle), 0, -std::cos(angle));
    EXPECT_GT(glm::dot(ComputeHalfAngleAxis({0, 0, -1}, light).axis, light), 0.7) << degrees;
  }
}

}  // namespace
}  // namespace halflight
