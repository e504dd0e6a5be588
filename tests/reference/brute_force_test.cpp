// The reference against the definitions written out as loops, in every kind of scene.
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "renderer/reference/evaluator.h"
#include "tests/oracle/plume.h"
#include "tests/reference/brute_force.h"
#include "tests/reference/test_scenes.h"

namespace halflight::reference {
namespace {

ParticleSet& Edit(Scene& scene) {
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  ParticleSet& editable = *set;
  scene.particles = set;
  return editable;
}

Light Sun() {
  Light light;
  light.kind = DirectionalLight{glm::normalize(glm::dvec3(0.5, -1.0, 0.2))};
  light.color = {1.0F, 2.0F, 3.0F};
  light.shadow_density = {1.0F, 0.5F, 2.0F};
  return light;
}

Light Lamp(const glm::dvec3& position, bool falloff) {
  Light light;
  light.kind = PointLight{position, falloff};
  return light;
}

struct ModelCase {
  const char* name;
  std::function<void(Scene&)> change;
};

class ReferenceModel : public testing::TestWithParam<ModelCase> {};

TEST_P(ReferenceModel, EqualsBruteForce) {
  Scene scene = RandomScene(60, 15);
  scene.time_offset_s = 0.5;
  scene.lights = {Sun()};
  GetParam().change(scene);
  const auto evaluator = Evaluator::Create(scene);
  ASSERT_TRUE(evaluator.ok());
  const std::vector<glm::ivec2> pixels = PixelsOf(scene.camera.window);
  const auto values = (*evaluator)->Evaluate(pixels);
  ASSERT_TRUE(values.ok());
  double covered = 0.0;
  for (size_t p = 0; p < pixels.size(); ++p) {
    const BruteForcePixel expected = RenderByBruteForce(scene, pixels[p]);
    covered += expected.rgba.a;
    ExpectNear(values->rgba[p], expected.rgba, 1e-9);
    if (expected.rgba.a < 1e-6) continue;
    EXPECT_NEAR(values->depth[p], expected.depth, 1e-9 * expected.depth);
    for (size_t light = 0; light < scene.lights.size(); ++light) {
      ExpectNear(glm::dvec4(values->transmittance[light][p], 0.0),
                 glm::dvec4(expected.transmittance[light], 0.0), 1e-9);
    }
  }
  EXPECT_GT(covered, 1.0);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, ReferenceModel,
    testing::Values(
        ModelCase{"Directional", [](Scene&) {}},
        ModelCase{"Balls", [](Scene& scene) { scene.material.profile = Profile::kBall; }},
        ModelCase{"PointOutside",
                  [](Scene& scene) {
                    scene.lights = {Lamp({2.0, 3.0, 1.0}, true)};
                  }},
        ModelCase{"PointInside",
                  [](Scene& scene) {
                    scene.lights = {Lamp({0.2, 0.4, -0.3}, true)};
                  }},
        ModelCase{"PointInsideBalls",
                  [](Scene& scene) {
                    scene.material.profile = Profile::kBall;
                    scene.lights = {Lamp({0.2, 0.4, -0.3}, false)};
                  }},
        ModelCase{"PointFarAway",
                  [](Scene& scene) {
                    scene.lights = {Lamp({3e4, 5e4, 2e4}, false)};
                  }},
        ModelCase{"ManyLights",
                  [](Scene& scene) {
                    Light open = Lamp({1.0, 2.0, 3.0}, true);
                    open.shadow_density = glm::vec3(0.0F);
                    scene.lights = {Sun(), Lamp({0.2, 0.4, -0.3}, false), open,
                                    Lamp({-2.0, 0.1, 0.0}, true), Sun()};
                    scene.lights[4].kind = DirectionalLight{{0.0, 0.0, 1.0}};
                    scene.lights[4].shadow_density = {0.0F, 1.0F, 0.0F};
                  }},
        ModelCase{"Orthographic",
                  [](Scene& scene) { scene.camera.projection = Orthographic{3.0}; }},
        ModelCase{"WideWindowWithSamples",
                  [](Scene& scene) {
                    scene.camera.width = 24;
                    scene.camera.window = {6, 3, 9, 7};
                    scene.sampling.supersample = 3;
                  }},
        ModelCase{"EyeInside",
                  [](Scene& scene) {
                    scene.camera.view_from_world = glm::lookAt(
                        glm::dvec3(0.1, 0.2, 0.3), glm::dvec3(0.7, 0.1, 0.6), glm::dvec3(0, 1, 0));
                    scene.camera.projection = Perspective{170.0 * std::numbers::pi / 180.0};
                  }},
        ModelCase{"NarrowViewFromFarAway",
                  [](Scene& scene) {
                    scene.camera.view_from_world = glm::lookAt(
                        glm::dvec3(900.0, 700.0, 500.0), glm::dvec3(0.0), glm::dvec3(0, 1, 0));
                    scene.camera.projection = Perspective{0.0025};
                  }},
        ModelCase{"RadiiOfFiveOrders",
                  [](Scene& scene) {
                    ParticleSet& set = Edit(scene);
                    for (size_t i = 0; i < set.size(); ++i) {
                      set.radii[i] = std::pow(10.0F, -static_cast<float>(i % 6)) * 2.0F;
                      set.opacities[i] *= 0.1F;
                    }
                  }},
        ModelCase{"CoplanarTies",
                  [](Scene& scene) {
                    ParticleSet& set = Edit(scene);
                    for (glm::vec3& position : set.positions) position.z = 0.25F;
                    for (glm::vec3& velocity : set.velocities) velocity = glm::vec3(0.0F);
                    scene.camera.projection = Orthographic{3.0};
                    scene.lights[0].kind = DirectionalLight{{0.0, 0.0, 1.0}};
                  }},
        ModelCase{"DenseAndClamped",
                  [](Scene& scene) {
                    for (float& opacity : Edit(scene).opacities) {
                      opacity = opacity > 0.3F ? 1.0F : 1.0F - 1e-7F;
                    }
                  }},
        ModelCase{"BrightLights",
                  [](Scene& scene) {
                    for (float& opacity : Edit(scene).opacities) opacity = 0.9F;
                    // Reaches the eye through depths that would hide an ordinary light.
                    scene.lights[0].color = glm::vec3(1e3F);
                  }}),
    [](const auto& param) { return std::string(param.param.name); });

TEST(ReferencePlume, EqualsBruteForceAtAFewPixels) {
  Scene scene = EmptyScene(64);
  auto set = oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  ASSERT_NE(set, nullptr);
  for (size_t i = 0; i < set->size(); ++i) {
    set->radii.push_back(0.02F + 0.002F * static_cast<float>(i % 17));
    set->opacities.push_back(0.05F + 0.02F * static_cast<float>(i % 13));
    set->colors.emplace_back(1.0F, 0.1F * static_cast<float>(i % 11), 0.5F);
    set->emissions.emplace_back(i % 29 == 0 ? 0.3F : 0.0F, 0.0F, 0.0F);
  }
  scene.particles = set;
  scene.material.phase_g = 0.5F;
  scene.camera.view_from_world =
      glm::lookAt(glm::dvec3(0.5, 1.5, 4.6), glm::dvec3(0, 1.25, 0), glm::dvec3(0, 1, 0));
  scene.camera.projection = Perspective{0.7};
  scene.lights = {Sun(), Lamp({0.05, 1.0, 0.0}, true)};
  const std::vector<glm::ivec2> pixels = {{32, 32}, {30, 40}, {35, 25}, {28, 36}};
  const auto values = (*Evaluator::Create(scene))->Evaluate(pixels);
  ASSERT_TRUE(values.ok());
  for (size_t p = 0; p < pixels.size(); ++p) {
    const BruteForcePixel expected = RenderByBruteForce(scene, pixels[p]);
    EXPECT_GT(expected.rgba.a, 0.3);
    ExpectNear(values->rgba[p], expected.rgba, 1e-9);
    EXPECT_NEAR(values->depth[p], expected.depth, 1e-8);
  }
}

}  // namespace
}  // namespace halflight::reference
