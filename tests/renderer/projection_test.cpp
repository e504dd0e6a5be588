// Projections: light cameras fitted to the particles, and independence of where the world's origin
// is.
#include "renderer/projection.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/renderer/test_scene.h"

namespace halflight {
namespace {

struct LightCase {
  const char* name;
  Light light;
};

Light Bulb(const glm::dvec3& position) {
  Light light;
  light.kind = PointLight{position};
  return light;
}

class LightCamera : public testing::TestWithParam<LightCase> {
 protected:
  LightCamera() : scene_(test::BallScene(400)) {}
  Scene scene_;
};

// Of all particles' outlines, sampled densely, in texture coordinates.
void OutlineBounds(const Scene& scene, const Projection& light, glm::dvec2& low, glm::dvec2& high) {
  low = glm::dvec2(std::numeric_limits<double>::infinity());
  high = -low;
  const glm::dmat4 texture_from_world = light.texture_from_world();
  for (const glm::vec3& center : scene.particles->positions) {
    for (int a = 0; a < 32; ++a) {
      for (int b = 0; b <= 16; ++b) {
        const double azimuth = a * std::numbers::pi / 16;
        const double polar = b * std::numbers::pi / 16;
        const glm::dvec3 normal(std::sin(polar) * std::cos(azimuth), std::cos(polar),
                                std::sin(polar) * std::sin(azimuth));
        const glm::dvec4 p =
            texture_from_world * glm::dvec4(scene.particles->origin + glm::dvec3(center) +
                                                normal * static_cast<double>(scene.material.radius),
                                            1.0);
        low = glm::min(low, glm::dvec2(p) / p.w);
        high = glm::max(high, glm::dvec2(p) / p.w);
      }
    }
  }
}

TEST_P(LightCamera, ShowsAllOfEveryParticleAndLittleElse) {
  constexpr int kSize = 256;
  const Projection light = LightProjection(GetParam().light, ParticleView(scene_), kSize, 0.0);
  glm::dvec2 low;
  glm::dvec2 high;
  OutlineBounds(scene_, light, low, high);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_GE(low[axis] * kSize, 2.0);
    EXPECT_LE(high[axis] * kSize, kSize - 2.0);
    EXPECT_GT((high[axis] - low[axis]) * kSize, 0.96 * kSize);
  }
}

TEST_P(LightCamera, LooksTheWayTheLightTravels) {
  const ParticleView particles(scene_);
  const Projection light = LightProjection(GetParam().light, particles, 64, 0.0);
  const glm::dvec3 travel = TravelDirection(GetParam().light, particles);
  const glm::dvec3 in_view = glm::dmat3(light.view_from_world) * travel;
  EXPECT_NEAR(in_view.z, -1.0, 1e-12);
}

TEST_P(LightCamera, GivesTheSameBlockWhereverTheWorldsOriginIs) {
  const glm::dvec3 far(1e7, -2e7, 3e7);
  Scene moved = scene_;
  auto set = std::make_shared<ParticleSet>(*scene_.particles);
  set->origin += far;
  moved.particles = set;
  Light light = GetParam().light;
  if (auto* point = std::get_if<PointLight>(&light.kind)) point->position += far;
  const auto here =
      LightProjection(GetParam().light, ParticleView(scene_), 64, 0.0).block(ParticleView(scene_));
  const auto there =
      LightProjection(light, ParticleView(moved), 64, 0.0).block(ParticleView(moved));
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(here.near_translation[i], there.near_translation[i], 1e-6);
    EXPECT_NEAR(here.far_translation[i], there.far_translation[i], 1e-6);
    EXPECT_NEAR(here.pixel_from_plane[i], there.pixel_from_plane[i], 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Lights, LightCamera,
                         testing::Values(LightCase{"Slanted", test::Sun({1, -1, -0.5})},
                                         LightCase{"StraightDown", test::Sun({0, -1, 0})},
                                         LightCase{"StraightUp", test::Sun({0, 1, 0})},
                                         LightCase{"AlongX", test::Sun({1, 0, 0})},
                                         LightCase{"PointFar", Bulb({10, 20, 5})},
                                         LightCase{"PointNear", Bulb({0, 1.5, 0.2})}),
                         [](const auto& param) { return param.param.name; });

TEST(TravelDirection, IsOfUnitLengthHoweverNearTheLightIs) {
  Scene scene = test::BallScene(1);
  auto set = std::make_shared<ParticleSet>();
  set->positions = {glm::vec3(0.0F)};
  scene.particles = set;
  scene.material.radius = 1.0F;
  const ParticleView particles(scene);
  for (const double near : {1e-160, 1e-300, 5e-324}) {
    EXPECT_NEAR(glm::length(TravelDirection(Bulb({0.0, near, near}), particles)), 1.0, 1e-12)
        << near;
  }
  EXPECT_EQ(TravelDirection(Bulb(glm::dvec3(0.0)), particles), glm::dvec3(0.0, -1.0, 0.0));
}

TEST(EyeProjection, PutsTheTargetInTheMiddleAndUpAtTheTop) {
  const Camera camera = test::LookAt({3, 1, 4}, {0, 1, 0}, 200, 100);
  const glm::dmat4 ndc = EyeProjection(camera, {200, 100}, 1.0).texture_from_world();
  const glm::dvec4 middle = ndc * glm::dvec4(0, 1, 0, 1);
  EXPECT_NEAR(middle.x / middle.w, 0.5, 1e-12);
  EXPECT_NEAR(middle.y / middle.w, 0.5, 1e-12);
  const glm::dvec4 above = ndc * glm::dvec4(0, 1.5, 0, 1);
  EXPECT_LT(above.y / above.w, 0.4);
}

TEST(EyeProjection, OfAWindowShowsThatPartOfTheWhole) {
  Camera camera = test::LookAt({3, 1, 4}, {0, 1, 0}, 200, 100);
  const glm::dvec4 p(0.3, 1.2, 0.1, 1.0);
  const glm::dvec4 whole = EyeProjection(camera, {200, 100}, 1.0).texture_from_world() * p;
  camera.window = {50, 20, 40, 80};
  const glm::dvec4 part = EyeProjection(camera, {80, 160}, 2.0).texture_from_world() * p;
  EXPECT_NEAR(part.x / part.w * 40 + 50, whole.x / whole.w * 200, 1e-9);
  EXPECT_NEAR(part.y / part.w * 80 + 20, whole.y / whole.w * 100, 1e-9);
}

}  // namespace
}  // namespace halflight
