// What is listed and shaded at once is a matter of memory alone: fits and images are the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <stop_token>
#include <thread>
#include <vector>

#include "renderer/sweep/compositor.h"
#include "renderer/sweep/light_fit.h"
#include "tests/renderer/test_scene.h"

namespace halflight::sweep {
namespace {

Scene MakeScene() {
  Scene scene = test::BallScene(3000, 150);
  test::VaryParticles(scene, 0.1F, 0.3F);
  scene.shadow.light_buffer_size = 200;
  scene.shadow.fit_degree = 3;
  scene.camera.view_from_world = glm::translate(scene.camera.view_from_world, {0.0, 0.0, 3.2});
  return scene;
}

LightFit Fit(const Scene& scene, const RunLimits& limits) {
  const ParticleView particles(scene);
  absl::StatusOr<LightFit> fit =
      FitLight(scene, particles, PlanLight(scene, particles, 0), {}, limits);
  EXPECT_TRUE(fit.ok());
  return *std::move(fit);
}

TEST(Runs, LeaveEveryBitOfAFit) {
  Scene scene = MakeScene();
  Scene layered = scene;
  layered.shadow.technique = ShadowTechniqueKind::kParticleShadowMap;
  layered.shadow.slices = 3;
  Scene spread = layered;
  spread.material.scattering_spread = 0.2F;
  Scene colored = spread;
  colored.lights[0].shadow_density = {0.3F, 0.6F, 1.2F};
  for (const Scene& tested : {scene, layered, spread, colored}) {
    const LightFit whole = Fit(tested, kLightRuns);
    for (const RunLimits limits :
         {RunLimits{1000, 1U << 20U}, RunLimits{3000, 500}, RunLimits{7, 9}}) {
      const LightFit fit = Fit(tested, limits);
      EXPECT_TRUE(fit.depth == whole.depth) << limits.rects;
      EXPECT_TRUE(fit.optical_depth.pixels == whole.optical_depth.pixels) << limits.rects;
    }
  }
}

// Slabs that hold nothing are passed through all the same, where light spreads between them.
TEST(Runs, EndSoonInManyEmptySlabs) {
  Scene scene = MakeScene();
  scene.shadow.technique = ShadowTechniqueKind::kParticleShadowMap;
  scene.shadow.slices = 65536;
  scene.shadow.light_buffer_size = 1024;
  scene.shadow.blur_mode = BlurMode::kTexelsPerSlice;
  scene.shadow.blur_texels = 64.0F;
  const ParticleView particles(scene);
  std::stop_source stop;
  std::jthread stops([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    stop.request_stop();
  });
  // Left alone it would take many minutes.
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(absl::IsCancelled(
      FitLight(scene, particles, PlanLight(scene, particles, 0), stop.get_token()).status()));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

Composite Draw(const Scene& scene, const LightFit& fit, const RunLimits& limits) {
  const ParticleView particles(scene);
  const glm::ivec2 size(scene.camera.width, scene.camera.height);
  const Projection eye = EyeProjection(scene.camera, size, 1.0);
  const SpriteList list = ListSprites(particles, eye, NearDepth(scene));
  EXPECT_FALSE(list.near.empty());
  const std::vector<TileLight> lights = ListTileLights(scene, true);
  Composite composite = MakeComposite(size, true, lights.size());
  for (const TileRun& run : CutIntoRuns(list.rects, kImageTile, limits)) {
    const TileLists tiles =
        ListTiles(std::span(list.rects).subspan(run.begin, run.size()), size, kImageTile);
    const Shading shading =
        ShadeSprites(scene, particles, eye, list, run, lights, {&fit}, fit.degree, true);
    EXPECT_TRUE(CompositeRun(list, tiles, shading, eye, scene.material.profile, {}, composite));
  }
  return composite;
}

void ExpectNear(const Image& a, const Image& b) {
  ASSERT_EQ(a.pixels.size(), b.pixels.size());
  double largest = 0.0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]));
  }
  EXPECT_LT(largest, 5e-6);
  EXPECT_GT(*std::max_element(a.pixels.begin(), a.pixels.end()), 0.1F);
}

// Chunks of particles begin elsewhere, so that sums are rounded otherwise.
TEST(Runs, LeaveAnImageButForRounding) {
  const Scene scene = MakeScene();
  const LightFit fit = Fit(scene, kLightRuns);
  const Composite whole = Draw(scene, fit, {});
  for (const RunLimits limits : {RunLimits{1000, 1U << 20U}, RunLimits{3000, 2000}}) {
    const Composite composite = Draw(scene, fit, limits);
    ExpectNear(composite.beauty, whole.beauty);
    ExpectNear(composite.depth, whole.depth);
    ExpectNear(composite.transmittance.at(0), whole.transmittance.at(0));
  }
}

}  // namespace
}  // namespace halflight::sweep
