// How large light buffers are that a request leaves open.
#include "renderer/light_buffer_size.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "renderer/frame_plan.h"
#include "renderer/projection.h"
#include "tests/renderer/test_scene.h"

namespace halflight {
namespace {

Scene Swept(float radius) {
  Scene scene = test::BallScene(2000);
  scene.material.radius = radius;
  scene.shadow.technique = ShadowTechniqueKind::kLightSweep;
  scene.shadow.light_buffer_size = 0;
  return scene;
}

int SizeFor(const Scene& scene) { return LightBufferSizeFor(scene, ParticleView(scene)); }

Light Bulb(const glm::dvec3& position) {
  Light light;
  light.kind = PointLight{position};
  return light;
}

TEST(LightBufferSize, LetsARadiusTakeFiveAndAHalfTexels) {
  for (const float radius : {0.02F, 0.05F, 0.1F, 0.2F}) {
    const Scene scene = Swept(radius);
    const int size = SizeFor(scene);
    const auto radius_in = [&](int texels) {
      const Projection light = LightProjection(scene.lights[0], ParticleView(scene), texels, 0.0);
      return radius *
             std::min(std::abs(light.pixel_from_plane.x), std::abs(light.pixel_from_plane.y));
    };
    // The border takes a few texels of each.
    EXPECT_GE(radius_in(size + 8), 5.5) << "radius " << radius << ", size " << size;
    if (size > 64) {
      EXPECT_LT(radius_in(size - 64), 5.5) << "radius " << radius << ", size " << size;
    }
  }
}

TEST(LightBufferSize, StaysWithinItsBounds) {
  EXPECT_EQ(SizeFor(Swept(1e-4F)), 1024);
  EXPECT_EQ(SizeFor(Swept(1.0F)), 64);
  Scene limited = Swept(1e-4F);
  limited.shadow.max_light_buffer_size = 100;
  EXPECT_EQ(SizeFor(limited), 100);
  Scene empty = Swept(0.1F);
  empty.particles = std::make_shared<ParticleSet>();
  EXPECT_EQ(SizeFor(empty), 64);
}

TEST(LightBufferSize, IsWhatTheSceneAsksFor) {
  Scene scene = Swept(0.05F);
  scene.shadow.light_buffer_size = 77;
  EXPECT_EQ(SizeFor(scene), 77);
  scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  EXPECT_EQ(SizeFor(scene), 77);
}

TEST(LightBufferSize, Is512WhereSlicesAreSwept) {
  Scene scene = Swept(0.2F);
  scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  EXPECT_EQ(SizeFor(scene), 512);
  scene.shadow.max_light_buffer_size = 300;
  EXPECT_EQ(SizeFor(scene), 300);
}

// A few specks, however small, hold next to nothing of the cloud.
TEST(LightBufferSize, DoesNotFollowSpecks) {
  Scene scene = Swept(0.1F);
  const int without = SizeFor(scene);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->radii.assign(set->size(), 0.1F);
  for (size_t i = 0; i < set->size(); i += 2) set->radii[i] = 1e-5F;
  scene.particles = set;
  EXPECT_EQ(SizeFor(scene), without);
}

TEST(LightBufferSize, FollowsTheLightThatNeedsMost) {
  Scene scene = Swept(0.1F);
  const int directional = SizeFor(scene);
  // Near a bulb that looks at the ball from 1.5 units most of it is far away and small.
  const Light bulb = Bulb({0.0, 1.5, 0.0});
  scene.lights = {bulb};
  const int point = SizeFor(scene);
  EXPECT_GT(point, directional);
  scene.lights = {test::Sun({1, -1, -0.5}), bulb};
  EXPECT_EQ(SizeFor(scene), point);
  scene.lights[1].shadow_density = glm::vec3(0.0F);
  EXPECT_EQ(SizeFor(scene), directional);
}

TEST(LightBufferSize, DoesNotDependOnScaleOrOrigin) {
  Scene scene = Swept(0.05F);
  const int size = SizeFor(scene);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->origin = {1e7, -1e7, 3e6};
  for (glm::vec3& position : set->positions) position *= 64.0F;
  scene.particles = set;
  scene.material.radius *= 64.0F;
  EXPECT_EQ(SizeFor(scene), size);
}

TEST(LightBufferSize, IsInThePlanAndItsReasons) {
  FrameRequest request = test::Beauty(Swept(0.05F));
  const ParticleView particles(request.scene);
  const FramePlan plan = *PlanFrame(request, particles);
  EXPECT_EQ(plan.light_buffer_size, LightBufferSizeFor(request.scene, particles));
  const std::string texels =
      std::to_string(plan.light_buffer_size) + " x " + std::to_string(plan.light_buffer_size);
  EXPECT_THAT(plan.passes,
              testing::Contains(testing::Field(&PlannedPass::reason, testing::HasSubstr(texels))));
}

}  // namespace
}  // namespace halflight
