// The reference against closed forms and sums by hand.
// brute_force_test.cpp has what needs many particles.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "renderer/reference/evaluator.h"
#include "tests/reference/test_scenes.h"

namespace halflight::reference {
namespace {

PixelValues Render(const Scene& scene) { return *(*Evaluator::Create(scene))->EvaluateWindow(); }

glm::dvec4 MiddlePixel(const Scene& scene) {
  const PixelValues values = Render(scene);
  return values.rgba[values.rgba.size() / 2];
}

TEST(Reference, OneParticleIsTheClosedForm) {
  for (const Profile profile : {Profile::kSoft, Profile::kBall}) {
    Scene scene = SceneOf({{0.3F, -0.2F, 0.0F}});
    scene.material.profile = profile;
    const std::vector<glm::ivec2> pixels = PixelsOf(scene.camera.window);
    const PixelValues image = Render(scene);
    for (size_t i = 0; i < pixels.size(); ++i) {
      const glm::dvec3 d = RayOf(scene, pixels[i]);
      const glm::dvec3 offset(0.3F, -0.2F, -10.0);
      const double rho = std::min(1.0, glm::length(glm::cross(offset, d)));
      const double w = profile == Profile::kSoft ? 1.0 - rho * rho : std::sqrt(1.0 - rho * rho);
      EXPECT_NEAR(image.rgba[i].a, 1.0 - std::pow(0.5, w), 1e-12);
      if (rho < 1.0) {
        EXPECT_NEAR(image.depth[i], glm::dot(offset, d) * -d.z, 1e-12);
      } else {
        EXPECT_EQ(image.depth[i], std::numeric_limits<double>::infinity());
      }
    }
  }
}

TEST(Reference, RowZeroIsTheTopAndXIsToTheRight) {
  Scene scene = SceneOf({{1.2F, 1.2F, 0.0F}});
  scene.material.radius = 0.3F;
  const PixelValues image = Render(scene);
  const std::vector<glm::ivec2> pixels = PixelsOf(scene.camera.window);
  const auto largest = std::max_element(image.rgba.begin(), image.rgba.end(),
                                        [](const auto& a, const auto& b) { return a.a < b.a; });
  const glm::ivec2 pixel = pixels[static_cast<size_t>(largest - image.rgba.begin())];
  EXPECT_GT(pixel.x, 16);
  EXPECT_LT(pixel.y, 16);
}

TEST(Reference, CoaxialParticlesMultiplyTheirTransparency) {
  for (const bool flat : {false, true}) {
    Scene scene = SceneOf(std::vector<glm::vec3>(7, glm::vec3(0.0F)));
    if (flat) scene.camera.projection = Orthographic{3.0};
    scene.material.opacity = 0.18F;
    EXPECT_NEAR(MiddlePixel(scene).a, 1.0 - std::pow(1.0 - 0.18F, 7), 1e-12);
  }
}

TEST(Reference, ManyThinLayersKeepTheirDigits) {
  Scene scene = SceneOf(std::vector<glm::vec3>(10'000, glm::vec3(0.0F)), 1);
  scene.material.opacity = 1e-6F;
  const double expected = -std::expm1(1e4 * std::log1p(-static_cast<double>(1e-6F)));
  EXPECT_NEAR(MiddlePixel(scene).a, expected, 1e-13);
}

TEST(Reference, OpacityOneIsDrawnAsTheLargest) {
  Scene scene = SceneOf({{0.0F, 0.0F, 0.0F}});
  scene.material.opacity = 1.0F;
  EXPECT_NEAR(MiddlePixel(scene).a, 1.0 - 0x1p-20, 1e-15);
}

TEST(Reference, TwoParticlesShadeEachOtherAsByHand) {
  const ShadedPair pair;
  ExpectNear(MiddlePixel(pair.scene), pair.middle_pixel);
}

TEST(Reference, ALightAmongParticlesIsShadedOnEachSideByThatSideAlone) {
  // Along the axis: far, near, lamp, near, far. Distances 1 and 3 to both sides.
  Scene scene =
      SceneOf({{0.0F, 0.0F, 3.0F}, {0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, -1.0F}, {0.0F, 0.0F, -3.0F}});
  scene.material.radius = 0.5F;
  Light lamp;
  lamp.kind = PointLight{{0.0, 0.0, 0.0}, true};
  scene.lights = {lamp};
  // Each of the far ones sees the lamp through one particle of transmittance 0.5.
  const double expected = 0.5 * 0.5 / 9.0 + 0.25 * 1.0 + 0.125 * 1.0 + 0.0625 * 0.5 / 9.0;
  ExpectNear(MiddlePixel(scene), glm::dvec4(glm::dvec3(expected), 0.9375));
}

TEST(Reference, ParticlesAtOnePlaceShadeByIndex) {
  Scene scene = SceneOf(std::vector<glm::vec3>(3, glm::vec3(0.0F)));
  scene.lights.resize(1);
  scene.lights[0].kind = DirectionalLight{{0.0, 0.0, 1.0}};  // towards the eye
  ExpectNear(MiddlePixel(scene), glm::dvec4(glm::dvec3(0.5 + 0.25 * 0.5 + 0.125 * 0.25), 0.875));
}

TEST(Reference, FarFromTheWorldsOriginNothingChanges) {
  Scene scene = RandomScene(40, 15);
  Light light;
  light.kind = PointLight{{0.5, 3.0, 1.0}, false};
  scene.lights = {light};
  const PixelValues here = Render(scene);
  const glm::dvec3 far(1e7, -2e7, 3e7);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->origin = far;
  scene.particles = set;
  scene.camera.view_from_world = glm::translate(scene.camera.view_from_world, -far);
  std::get<PointLight>(scene.lights[0].kind).position += far;
  const PixelValues there = Render(scene);
  for (size_t i = 0; i < here.rgba.size(); ++i) ExpectNear(there.rgba[i], here.rgba[i], 1e-6);
}

}  // namespace
}  // namespace halflight::reference
