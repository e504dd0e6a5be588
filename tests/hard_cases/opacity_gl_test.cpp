// Opacities at both ends, and particles smaller than a pixel.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "tests/hard_cases/hard_case.h"

namespace halflight {
namespace {

class Opacity : public test::HardCase {};

// `layers` particles behind one another on the axis of one pixel that they cover evenly.
Scene Layers(int layers, float opacity) {
  Scene scene = test::BallScene(0, 1);
  auto set = std::make_shared<ParticleSet>();
  for (int i = 0; i < layers; ++i) {
    set->positions.emplace_back(0.0F, 0.0F, -static_cast<float>(i) / static_cast<float>(layers));
  }
  scene.particles = set;
  scene.camera.projection = Orthographic{1e-6};
  scene.material.radius = 1.0F;
  scene.material.opacity = opacity;
  scene.lights.clear();
  return scene;
}

TEST_F(Opacity, AMillionLayersOfAMillionth) {
  Scene scene = Layers(1'000'000, 1e-6F);
  const double expected = -std::expm1(1e6 * std::log1p(-static_cast<double>(1e-6F)));
  const std::string subject = "a million layers of opacity 1e-6";
  test::ExpectAtMost(subject, "coverage from 1 - (1 - a)^N, front to back",
                     test::CoverageError(RenderBeauty(scene), expected), 0.001);
  scene.lights = {test::Sun({0, 0, 1}, 1e-30F)};  // towards the eye
  scene.shadow.light_buffer_size = 16;
  scene.shadow.slices = 4;
  test::ExpectAtMost(subject, "coverage from 1 - (1 - a)^N, back to front",
                     test::CoverageError(RenderBeauty(scene), expected), 0.003);
  scene.lights.clear();
  scene.shadow.technique = ShadowTechniqueKind::kReference;
  test::ExpectAtMost(subject, "coverage from 1 - (1 - a)^N, reference",
                     test::CoverageError(RenderBeauty(scene), expected), 3e-8);
}

TEST_F(Opacity, AMillionLayersShadeByTheirSum) {
  // Light along the view: the last layers get exp(-N tau) of it.
  Scene scene = Layers(1'000'000, 1e-6F);
  scene.lights = {test::Sun({0, 0, -1})};
  scene.shadow.light_buffer_size = 17;  // the middle of a texel is on the axis
  scene.shadow.slices = 64;
  const FrameRequest request{scene, {{ImageKind::kLightBuffer, 0, LightQuantity::kOpticalDepth}}};
  const Image depth = Render(request).images.at(0);
  const double expected = -1e6 * std::log1p(-static_cast<double>(1e-6F));
  const float deepest = *std::max_element(depth.pixels.begin(), depth.pixels.end());
  test::ExpectAtMost("a million layers of opacity 1e-6", "optical depth of the light, relative",
                     std::abs(deepest / expected - 1.0), 0.013);
}

TEST_F(Opacity, TenLayersOfAllButATenMillionth) {
  Scene scene = Layers(10, 1.0F - 1e-7F);
  scene.camera = test::LookAt({0, 0, 4}, {0, 0, 0}, 40, 40);
  scene.lights = {test::Sun({1, -1, -1}), test::Sun({1, 0.3, 1})};
  scene.shadow.light_buffer_size = 512;
  Hold("ten layers of opacity 1 - 1e-7", scene, {9e-6, 2e-4, 2e-4, 1e-7});
}

TEST_F(Opacity, OpticalDepthInTheThousands) {
  Scene scene = test::BallScene(4000, 40);
  scene.material.radius = 0.3F;
  scene.material.opacity = 0.9999F;  // 9.2; three hundred on a ray
  for (const glm::dvec3& direction : {glm::dvec3(1, -1, -0.5), glm::dvec3(0.2, 0, 1)}) {
    scene.lights = {test::Sun(direction, 3.0F)};
    scene.shadow.light_buffer_size = 1024;
    const bool back_light = direction.z > 0.0;
    // From the side the axis' tilt lets light pass where the model has none.
    Hold(
        std::string("optical depth in the thousands, ") + (back_light ? "back" : "side") + " light",
        scene, {2.5e-5, 0.007, back_light ? 0.02 : 3.0, 1e-7});
  }
}

// 64 x 64 particles of a fifth of a pixel, no two at the same place within their pixels.
Scene SubPixelParticles() {
  constexpr int kAcross = 64;
  constexpr float kStep = 2.0F + 1.0F / kAcross;
  constexpr int kSize = 132;
  Scene scene = test::BallScene(0, kSize);
  auto set = std::make_shared<ParticleSet>();
  for (int i = 0; i < kAcross * kAcross; ++i) {
    set->positions.emplace_back(2.0F + kStep * static_cast<float>(i % kAcross) - kSize / 2,
                                2.0F + kStep * static_cast<float>(i / kAcross) - kSize / 2, 0.0F);
  }
  scene.particles = set;
  scene.camera.projection = Orthographic{kSize};  // a world unit a pixel
  scene.camera.view_from_world[3] = {0.0, 0.0, -100.0, 1.0};
  scene.material.opacity = 0.5F;
  scene.material.radius = 0.2F;
  scene.lights.clear();
  return scene;
}

double SumOfCoverage(const Image& beauty) {
  double sum = 0.0;
  for (size_t i = 3; i < beauty.pixels.size(); i += 4) sum += beauty.pixels[i];
  return sum;
}

TEST_F(Opacity, ParticlesBelowAPixelKeepTheirCoverageInTheMean) {
  // Pixels are sampled at their centres: one particle shows or does not, by where it stands, as the
  // model says. What is conserved under motion is the mean.
  Scene scene = SubPixelParticles();
  const double tau = -std::log1p(-0.5);
  // The integral of 1 - exp(-tau (1 - rho^2)) over the disc.
  const double integral = std::numbers::pi * 0.2F * 0.2F * (1.0 - 0.5 / tau);
  const auto count = static_cast<double>(scene.particles->size());
  for (const int samples : {1, 4}) {
    scene.sampling.supersample = samples;
    const std::string subject =
        "particles of 0.2 pixels, " + std::to_string(samples * samples) + " samples";
    const Image image = RenderBeauty(scene);
    test::ExpectAtMost(subject, "mean coverage from the integral, relative",
                       std::abs(SumOfCoverage(image) / count / integral - 1.0), 2e-4);
    scene.shadow.technique = ShadowTechniqueKind::kReference;
    test::ExpectAtMost(subject, "image from the model, largest",
                       test::MaxDifference(image, RenderBeauty(scene)), 1e-4);
    scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  }
}

TEST_F(Opacity, MovingParticlesBelowAPixelFlickerLessWithSamples) {
  // One particle carried over a pixel: how far its coverage strays from the integral.
  Scene scene = test::BallScene(0, 5);
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{0.0F, 0.0F, 0.0F}};
  set->velocities = {{1.0F, 0.37F, 0.0F}};
  scene.particles = set;
  scene.camera.projection = Orthographic{5.0};
  scene.material.opacity = 0.5F;
  scene.material.radius = 0.2F;
  scene.lights.clear();
  const double tau = -std::log1p(-0.5);
  const double integral = std::numbers::pi * 0.2F * 0.2F * (1.0 - 0.5 / tau);
  struct Samples {
    int across;
    double allowed;
  };
  for (const Samples& samples : {Samples{1, 8.0}, {2, 1.2}, {4, 0.15}, {8, 0.07}}) {
    scene.sampling.supersample = samples.across;
    double squares = 0.0;
    for (int step = 0; step < 64; ++step) {
      scene.time_offset_s = (step + 0.5) / 64.0 - 0.5;
      squares += std::pow(SumOfCoverage(RenderBeauty(scene)) / integral - 1.0, 2);
    }
    test::ExpectAtMost("a particle of 0.2 pixels, moving, " +
                           std::to_string(samples.across * samples.across) + " samples",
                       "coverage from the integral, relative RMS", std::sqrt(squares / 64.0),
                       samples.allowed);
  }
}

}  // namespace
}  // namespace halflight
