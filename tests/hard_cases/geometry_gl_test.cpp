// Where particles lie to the eye and to one another, and how they are projected.
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "tests/hard_cases/hard_case.h"
#include "tests/oracle/image_error.h"
#include "tests/oracle/oracle.h"

namespace halflight {
namespace {

class Geometry : public test::HardCase {};

TEST_F(Geometry, CameraInsideTheCloud) {
  Scene scene = test::BallScene(1500, 40);
  scene.camera = test::LookAt({0.1, 0.2, 0.3}, {0.7, 0.1, -0.6}, 40, 40);
  scene.camera.projection = Perspective{90.0 * test::kDegree};
  scene.shadow.light_buffer_size = 512;
  Hold("camera inside the cloud", scene, {5e-7, 0.002, 0.04, 1e-7});
}

TEST_F(Geometry, ParticlesAcrossTheNearPlaneAndRoundTheEye) {
  // All of them reach the eye's plane, and many hold the eye.
  Scene scene = test::BallScene(60, 40);
  ParticleSet& set = test::EditParticles(scene);
  for (size_t i = 0; i < set.size(); ++i) {
    set.positions[i] *= 0.5F;
    set.radii.push_back(0.2F + 0.5F * static_cast<float>(i % 7) / 7.0F);
  }
  scene.camera = test::LookAt({0, 0, 0}, {0.2, -0.1, -1}, 40, 40);
  scene.camera.projection = Perspective{100.0 * test::kDegree};
  scene.shadow.light_buffer_size = 512;
  Hold("particles across the near plane", scene, {2e-7, 2e-4, 1, 1e-7});
}

TEST_F(Geometry, OneParticle) {
  Scene scene = test::BallScene(1, 40);
  scene.material.radius = 0.5F;
  Hold("one particle", scene, {6e-7, 2e-6, 2e-6, 1e-7});
}

TEST_F(Geometry, DenormalsAreAsGoodAsZero) {
  Scene scene = test::BallScene(2, 40);
  ParticleSet& set = test::EditParticles(scene);
  set.positions[0] = {1e-40F, -1e-40F, 0.0F};
  set.opacities = {0.5F, 1e-40F};
  const Image denormal = RenderBeauty(scene);
  ParticleSet& zeros = test::EditParticles(scene);
  zeros.positions[0] = glm::vec3(0.0F);
  zeros.opacities[1] = 0.0F;
  test::ExpectAtMost("denormal offset and opacity", "from zeros, largest",
                     test::MaxDifference(denormal, RenderBeauty(scene)), 1e-37);
}

TEST_F(Geometry, TwoCoplanarParticles) {
  // Overlapping at one depth, for the light as for the eye: the lower index shades the other.
  Scene scene = test::BallScene(0, 40);
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{0.2F, 0.0F, 0.0F}, {-0.2F, 0.1F, 0.0F}};
  set->colors = {{1.0F, 0.2F, 0.2F}, {0.2F, 0.2F, 1.0F}};
  scene.particles = set;
  scene.camera.projection = Orthographic{2.0};
  scene.material.radius = 0.6F;
  scene.material.opacity = 0.6F;
  scene.shadow.light_buffer_size = 512;
  scene.lights = {test::Sun({0, 0, -1})};
  Hold("two coplanar particles", scene, {7e-7, 5e-5, 5e-5, 1e-7});
}

TEST_F(Geometry, AMillionCoplanarParticles) {
  Scene scene = test::BallScene(0, 32);
  auto set = std::make_shared<ParticleSet>();
  std::mt19937 random(5);
  const auto uniform = [&] { return static_cast<float>(random()) * 0x1p-31F - 1.0F; };
  for (int i = 0; i < 1'000'000; ++i) {
    const float x = uniform();
    set->positions.emplace_back(x, uniform(), 0.0F);
  }
  scene.particles = set;
  scene.camera.projection = Orthographic{1.8};
  scene.material.radius = 0.004F;  // twelve over each other
  scene.material.opacity = 0.1F;
  scene.shadow.light_buffer_size = 2048;
  scene.shadow.slices = 32;
  scene.lights = {test::Sun({0, 0, -1})};
  const Image image = RenderBeauty(scene);
  const oracle::OracleOptions few{.stride = 3};
  const oracle::OracleImage exact = oracle::RenderExact(scene, few);
  const std::string subject = "a million coplanar particles";
  test::ExpectAtMost(subject, "coverage from the model, largest",
                     oracle::CompareCoverage(image, exact).max, 1.2e-5);
  test::ExpectAtMost(subject, "colour from exact slicing, relative RMSE",
                     oracle::CompareColor(image, oracle::RenderHalfAngle(scene, few)).relative_rmse,
                     0.01);
  test::ExpectAtMost(subject, "colour from the model, relative RMSE",
                     oracle::CompareColor(image, exact).relative_rmse, 0.011);
}

// Clusters of small particles within large ones, every second particle large.
Scene RadiiOfFiveOrders() {
  Scene scene = test::BallScene(400, 40);
  ParticleSet& set = test::EditParticles(scene);
  for (size_t i = 0; i < set.size(); ++i) {
    const bool large = i % 2 == 0;
    set.radii.push_back(large ? 1.0F : 1e-5F);
    set.opacities.push_back(large ? 0.02F : 0.4F);
    if (!large) set.positions[i] *= 1e-4F;
  }
  scene.shadow.light_buffer_size = 512;
  return scene;
}

TEST_F(Geometry, RadiiOfOneToAHundredThousandFromAfar) {
  Hold("radii 1e5 : 1 from afar", RadiiOfFiveOrders(), {7e-7, 1e-5, 0.09, 1e-7});
}

TEST_F(Geometry, RadiiOfOneToAHundredThousandFromNear) {
  Scene scene = RadiiOfFiveOrders();
  scene.camera.projection = Orthographic{3e-4};
  // The light buffer has no texels for the small ones: their shadows on each other are lost.
  Hold("radii 1e5 : 1 from near", scene, {7e-7, 0.02, 0.2, 1e-7});
}

TEST_F(Geometry, OrthographicOneDegreeAndAHundredAndSeventy) {
  Scene scene = test::BallScene(1500, 40);
  scene.shadow.light_buffer_size = 512;
  scene.camera.projection = Orthographic{2.4};
  Hold("orthographic view", scene, {5e-6, 7e-4, 0.08, 1e-7});
  scene.camera = test::LookAt({0, 0, 140}, {0, 0, 0}, 40, 40);
  scene.camera.projection = Perspective{1.0 * test::kDegree};
  Hold("field of view 1 degree", scene, {3e-6, 7e-4, 0.08, 1e-7});
  scene.camera = test::LookAt({0, 0, 3e6}, {0, 0, 0}, 40, 40);
  scene.camera.projection = Perspective{std::atan(8e-7)};
  Hold("eye 3e6 away", scene, {3e-6, 7e-4, 0.08, 1e-7});
  scene.camera = test::LookAt({0, 0, 1.1}, {0, 0, 0}, 40, 40);
  scene.camera.projection = Perspective{170.0 * test::kDegree};
  Hold("field of view 170 degrees", scene, {2e-6, 5e-4, 0.2, 1e-7});
}

}  // namespace
}  // namespace halflight
