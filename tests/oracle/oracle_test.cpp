// Half-angle slicing against sums by hand, its slices, and how far it is from the model.
// brute_force_test.cpp has what needs many particles.
#include "tests/oracle/oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/oracle/half_angle.h"
#include "tests/oracle/image_error.h"
#include "tests/oracle/plume.h"
#include "tests/reference/test_scenes.h"

namespace halflight::oracle {
namespace {

using reference::ExpectNear;
using reference::RandomScene;
using reference::SceneOf;

glm::dvec4 MiddlePixel(const OracleImage& image) { return image.rgba[image.rgba.size() / 2]; }

TEST(Oracle, TwoParticlesShadeEachOtherAsByHand) {
  const reference::ShadedPair pair;
  Scene scene = pair.scene;
  const glm::dvec4& expected = pair.middle_pixel;
  scene.shadow.slices = 2;
  ExpectNear(MiddlePixel(RenderHalfAngle(scene)), expected);
  // In one slice, interpolated: the second sees all of the slice but itself, the first nothing.
  scene.shadow.slices = 1;
  ExpectNear(MiddlePixel(RenderHalfAngle(scene)), expected);
  // Plain: nothing lies in earlier slices.
  scene.shadow.interpolate = false;
  ExpectNear(MiddlePixel(RenderHalfAngle(scene)), glm::dvec4(0.75));
}

TEST(Oracle, FewSlicesSplitWhatManyOrder) {
  // 10 in 4 slices: 2, 3, 2, 3, as floor(s N / S) has it.
  std::vector<glm::vec3> positions(10, glm::vec3(0.0F));
  for (size_t i = 0; i < positions.size(); ++i) positions[i].z = -static_cast<float>(i);
  const Scene scene = SceneOf(positions);
  const HalfAngleOrder order =
      OrderByHalfAngle(reference::ResolveCloud(scene), reference::Rays::Along({0.0, 0.0, -1.0}),
                       {0.0, 0.0, -1.0}, {.slices = 4});
  std::vector<uint32_t> begins;
  for (const SlicePlace& place : order.places) begins.push_back(place.begin);
  EXPECT_EQ(begins, (std::vector<uint32_t>{0, 0, 2, 2, 2, 5, 5, 7, 7, 7}));
  EXPECT_EQ(order.places[3].fraction, 0.5);
  EXPECT_EQ(order.places[4].fraction, 1.0);
}

TEST(Oracle, EqualOpticalDepthWeighsParticles) {
  Scene scene = SceneOf({{0, 0, 0}, {0, 0, -1}, {0, 0, -2}, {0, 0, -3}});
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->radii = {1.0F, 1.0F, 1.0F, 3.0F};  // the last weighs 9 of 12
  scene.particles = set;
  const HalfAngleOrder order = OrderByHalfAngle(
      reference::ResolveCloud(scene), reference::Rays::Along({0.0, 0.0, -1.0}), {0.0, 0.0, -1.0},
      {.slices = 2, .spacing = SliceSpacing::kEqualOpticalDepth});
  EXPECT_EQ(order.places[2].end, 3U);
  EXPECT_EQ(order.places[3].begin, 3U);
}

TEST(Oracle, DensityZeroIsUnshadowedAndFurtherLightsAddUp) {
  Scene scene = RandomScene(40, 15);
  Light shaded;
  shaded.kind = DirectionalLight{glm::normalize(glm::dvec3(1.0, -1.0, -1.0))};
  Light open = shaded;
  open.shadow_density = glm::vec3(0.0F);
  Light lamp;
  lamp.kind = PointLight{{0.0, 3.0, 1.0}, true};

  scene.material.ambient = glm::vec3(0.0F);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->emissions.clear();
  scene.particles = set;
  const auto render = [&](std::vector<Light> lights) {
    scene.lights = std::move(lights);
    return RenderHalfAngle(scene);
  };
  const OracleImage first = render({shaded});
  const OracleImage second = render({lamp});
  const OracleImage both = render({shaded, lamp});
  for (size_t i = 0; i < both.rgba.size(); ++i) {
    const glm::dvec3 sum = glm::dvec3(first.rgba[i]) + glm::dvec3(second.rgba[i]);
    ExpectNear(both.rgba[i], glm::dvec4(sum, first.rgba[i].a), 1e-9);
  }
  const OracleImage unlit = render({open});
  EXPECT_EQ(unlit.transmittance.front().front(), glm::dvec3(1.0));
  const OracleImage unshadowed = RenderUnshadowed(scene);
  EXPECT_LT(CompareColor(unlit, unshadowed).rmse, 0.02);  // only the order differs
}

TEST(Oracle, AWindowIsPartOfTheWholeAndAStrideASubset) {
  Scene scene = RandomScene(40, 21);
  const OracleImage whole = RenderUnshadowed(scene);
  scene.camera.window = {5, 3, 10, 12};
  const OracleImage part = RenderUnshadowed(scene, {.stride = 2});
  ASSERT_EQ(part.pixels.size(), 30U);
  for (size_t i = 0; i < part.pixels.size(); ++i) {
    const glm::ivec2 place = part.pixels[i] + glm::ivec2(5, 3);
    EXPECT_EQ(part.rgba[i], whole.rgba[static_cast<size_t>(place.y * 21 + place.x)]);
  }
}

TEST(Oracle, FarFromTheWorldsOriginNothingChanges) {
  Scene scene = RandomScene(40, 15);
  Light light;
  light.kind = PointLight{{0.5, 3.0, 1.0}, false};
  scene.lights = {light};
  const OracleImage here = RenderHalfAngle(scene);
  const glm::dvec3 far(1e7, -2e7, 3e7);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->origin = far;
  scene.particles = set;
  scene.camera.view_from_world = glm::translate(scene.camera.view_from_world, -far);
  std::get<PointLight>(scene.lights[0].kind).position += far;
  const OracleImage there = RenderHalfAngle(scene);
  EXPECT_LT(CompareColor(there, here).max, 1e-6);
}

TEST(Oracle, PlumeDarkensWhereTheModelSaysItDoes) {
  Scene scene;
  scene.particles = LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  ASSERT_NE(scene.particles, nullptr);
  ASSERT_EQ(scene.particles->size(), 56'000U);
  scene.material.radius = 0.045F;
  scene.camera.view_from_world =
      glm::lookAt(glm::dvec3(0.5, 1.5, 4.6), glm::dvec3(0, 1.25, 0), glm::dvec3(0, 1, 0));
  scene.camera.width = scene.camera.height = 240;
  scene.camera.window = {0, 0, 240, 240};
  Light light;
  light.kind = DirectionalLight{glm::normalize(glm::dvec3(-1.0, -1.0, -0.4))};
  scene.lights = {light};
  const OracleOptions few{.stride = 8};
  const OracleImage exact = RenderExact(scene, few);
  const double plain_error = [&] {
    scene.shadow.interpolate = false;
    return CompareColor(RenderHalfAngle(scene, few), exact).relative_rmse;
  }();
  scene.shadow.interpolate = true;
  const ImageError interpolated = CompareColor(RenderHalfAngle(scene, few), exact);
  // DESIGN's table: 31 % and 11 % about 50 degrees from the view, 47 % and 16 % about 75.
  EXPECT_GT(plain_error, 0.2);
  EXPECT_LT(plain_error, 0.6);
  EXPECT_GT(interpolated.relative_rmse, 0.05);
  EXPECT_LT(interpolated.relative_rmse, 0.25);
  EXPECT_EQ(interpolated.pixels, 900U);
}

}  // namespace
}  // namespace halflight::oracle
