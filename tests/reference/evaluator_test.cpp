// What the evaluation of pixels promises beyond their values.
#include "renderer/reference/evaluator.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/oracle/plume.h"
#include "tests/reference/test_scenes.h"

namespace halflight::reference {
namespace {

Scene PlumeScene(int size) {
  Scene scene;
  scene.particles = oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  scene.material.radius = 0.045F;
  scene.camera.view_from_world =
      glm::lookAt(glm::dvec3(0.5, 1.5, 4.6), glm::dvec3(0, 1.25, 0), glm::dvec3(0, 1, 0));
  scene.camera.width = scene.camera.height = size;
  scene.camera.window = {0, 0, size, size};
  Light sun;
  sun.kind = DirectionalLight{glm::normalize(glm::dvec3(1.0, -0.6, -0.6))};
  Light lamp;
  lamp.kind = PointLight{{0.05, 1.0, 0.0}, true};
  scene.lights = {sun, lamp};
  return scene;
}

TEST(Evaluator, AnySubsetOnAnyThreadsHasTheBitsOfTheWholeImage) {
  const Scene scene = PlumeScene(48);
  ASSERT_NE(scene.particles, nullptr);
  const auto evaluator = Evaluator::Create(scene);
  ASSERT_TRUE(evaluator.ok());
  const auto whole = (*evaluator)->EvaluateWindow({.threads = 1});
  ASSERT_TRUE(whole.ok());
  std::mt19937 random(3);
  const auto other = Evaluator::Create(scene);  // another object, of the same scene
  ASSERT_TRUE(other.ok());
  for (const int threads : {1, 2, 7}) {
    std::vector<glm::ivec2> pixels(100);
    for (glm::ivec2& pixel : pixels) {
      pixel = {static_cast<int>(random() % 48), static_cast<int>(random() % 48)};
    }
    const auto part = (*other)->Evaluate(pixels, {.threads = threads});
    ASSERT_TRUE(part.ok());
    for (size_t i = 0; i < pixels.size(); ++i) {
      const auto k = static_cast<size_t>(pixels[i].y) * 48 + static_cast<size_t>(pixels[i].x);
      EXPECT_EQ(part->rgba[i], whole->rgba[k]);
      EXPECT_EQ(part->depth[i], whole->depth[k]);
      for (size_t light = 0; light < 2; ++light) {
        EXPECT_EQ(part->transmittance[light][i], whole->transmittance[light][k]);
      }
    }
  }
}

TEST(Evaluator, AWindowHasTheBitsOfTheWholeImage) {
  Scene scene = RandomScene(60, 24);
  const auto whole = (*Evaluator::Create(scene))->EvaluateWindow();
  scene.camera.window = {5, 3, 10, 12};
  const auto part = (*Evaluator::Create(scene))->EvaluateWindow();
  ASSERT_EQ(part->rgba.size(), 120U);
  for (size_t i = 0; i < part->rgba.size(); ++i) {
    EXPECT_EQ(part->rgba[i], whole->rgba[(i / 10 + 3) * 24 + i % 10 + 5]);
  }
}

TEST(Evaluator, ProgressRisesToTheEnd) {
  const auto evaluator = Evaluator::Create(RandomScene(60, 33));
  std::vector<size_t> seen;
  EvaluateOptions options;
  options.progress = [&seen](size_t done, size_t total) {
    EXPECT_EQ(total, 33U * 33U);
    seen.push_back(done);
  };
  ASSERT_TRUE((*evaluator)->EvaluateWindow(options).ok());
  EXPECT_GT(seen.size(), 10U);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 33U * 33U);
}

// Stops `work` while it is at it; it must then end as cancelled.
template <typename Work>
void ExpectStops(const Work& work) {
  std::stop_source source;
  const std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    source.request_stop();
  });
  EXPECT_EQ(work(source.get_token()).code(), absl::StatusCode::kCancelled);
}

TEST(Evaluator, StopsAmidOnePixel) {
  // The only pixel would take a minute: each of 60,000 particles on its ray sums up the others.
  auto set = std::make_shared<ParticleSet>();
  set->positions.assign(60'000, glm::vec3(0.0F));
  for (size_t i = 0; i < set->size(); ++i) set->positions[i].z = -1e-5F * static_cast<float>(i);
  Scene scene = EmptyScene(1);
  scene.particles = set;
  scene.material.opacity = 1e-6F;
  Light light;
  light.kind = DirectionalLight{{0.0, 0.0, -1.0}};
  scene.lights.assign(20, light);
  const auto evaluator = Evaluator::Create(scene);
  ASSERT_TRUE(evaluator.ok());
  ExpectStops([&](const std::stop_token& stop) {
    EvaluateOptions options;
    options.stop = stop;
    return (*evaluator)->EvaluateWindow(options).status();
  });
}

TEST(Evaluator, StopsWhileItIndexes) {
  auto set = std::make_shared<ParticleSet>();
  std::mt19937 random(1);
  const auto place = [&random] { return static_cast<float>(random()) * 0x1p-32F; };
  for (int i = 0; i < 1'000'000; ++i) set->positions.emplace_back(place(), place(), place());
  Scene scene = EmptyScene(32);
  scene.particles = set;
  scene.material.radius = 0.01F;
  scene.lights.resize(4);
  ExpectStops([&](const std::stop_token& stop) { return Evaluator::Create(scene, stop).status(); });
}

TEST(Evaluator, NothingToSeeIsEmptySpace) {
  for (const bool none : {false, true}) {
    Scene scene = EmptyScene(3);
    scene.lights.resize(1);
    if (none) scene.particles = nullptr;
    const auto values = (*Evaluator::Create(scene))->EvaluateWindow();
    ASSERT_TRUE(values.ok());
    EXPECT_EQ(values->rgba[4], glm::dvec4(0.0));
    EXPECT_EQ(values->depth[4], HUGE_VAL);
    EXPECT_EQ(values->transmittance[0][4], glm::dvec3(1.0));
  }
}

}  // namespace
}  // namespace halflight::reference
