// How much memory a frame of the light sweep takes, a particle: what docs/memory.md says.
// Counts what the renderer allocates in this process, by replacing operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <iostream>
#include <new>

#include <malloc.h>

#include "renderer/sweep/compositor.h"
#include "renderer/sweep/light_fit.h"
#include "tests/renderer/test_scene.h"

namespace {

std::atomic<size_t> held = 0;
std::atomic<size_t> peak = 0;

void Count(size_t bytes) {
  const size_t now = held += bytes;
  size_t before = peak;
  while (now > before && !peak.compare_exchange_weak(before, now)) {
  }
}

}  // namespace

void* operator new(size_t bytes) {
  void* const memory = std::malloc(bytes);
  if (memory == nullptr) throw std::bad_alloc();
  Count(malloc_usable_size(memory));
  return memory;
}
void* operator new(size_t bytes, const std::nothrow_t& /*tag*/) noexcept {
  void* const memory = std::malloc(bytes);
  if (memory != nullptr) Count(malloc_usable_size(memory));
  return memory;
}
void* operator new(size_t bytes, std::align_val_t alignment) {
  const auto align = static_cast<size_t>(alignment);
  void* const memory = std::aligned_alloc(align, (bytes + align - 1) / align * align);
  if (memory == nullptr) throw std::bad_alloc();
  Count(malloc_usable_size(memory));
  return memory;
}
void operator delete(void* memory) noexcept {
  held -= malloc_usable_size(memory);
  std::free(memory);
}
void operator delete(void* memory, size_t /*bytes*/) noexcept { operator delete(memory); }
void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept {
  operator delete(memory);
}

namespace halflight::sweep {
namespace {

// Bytes at most that were held at once while `work` ran, beyond what was held before.
template <typename Work>
size_t PeakOf(const Work& work) {
  const size_t before = held;
  peak = before;
  work();
  return peak - before;
}

struct Peaks {
  double light;
  double eye;
};

// Of a frame of so many particles, each of which covers a few pixels.
Peaks PeaksOf(size_t count) {
  Scene scene = test::BallScene(count, 640);
  scene.material.radius = 0.01F;
  scene.shadow.light_buffer_size = 256;
  const ParticleView particles(scene);
  LightFit fit;
  Peaks peaks{};
  peaks.light = static_cast<double>(
      PeakOf([&] { fit = *FitLight(scene, particles, PlanLight(scene, particles, 0), {}); }));
  peaks.eye = static_cast<double>(PeakOf([&] {
    const glm::ivec2 size(640, 640);
    const Projection eye = EyeProjection(scene.camera, size, 1.0);
    const SpriteList list = ListSprites(particles, eye, NearDepth(scene));
    const std::vector<TileLight> lights = ListTileLights(scene, false);
    Composite composite = MakeComposite(size, false, 0);
    for (const TileRun& run : CutIntoRuns(list.rects, kImageTile, {})) {
      const TileLists tiles =
          ListTiles(std::span(list.rects).subspan(run.begin, run.size()), size, kImageTile);
      const Shading shading =
          ShadeSprites(scene, particles, eye, list, run, lights, {&fit}, fit.degree, false);
      CompositeRun(list, tiles, shading, eye, scene.material.profile, {}, composite);
    }
  }));
  return peaks;
}

// What more particles take, once there are several runs of them.
TEST(Memory, OfAParticleIsWhatTheDocumentationSays) {
  BlockCache::SetLimit(0);  // what is idle is no frame's
  constexpr size_t kFew = 300'000;
  constexpr size_t kMany = 600'000;
  const Peaks few = PeaksOf(kFew);
  const Peaks many = PeaksOf(kMany);
  const double light = (many.light - few.light) / (kMany - kFew);
  const double eye = (many.eye - few.eye) / (kMany - kFew);
  std::cout << "bytes a particle: light " << light << ", eye " << eye << "; at " << kFew
            << " particles " << few.light / kFew << ", " << few.eye / kFew << "\n";
  EXPECT_LT(light, 88.0 * 9 / 8 + 6.0);  // an array takes up to an eighth more
  EXPECT_LT(eye, 35.0);
}

// However many particles a bin of a particle shadow map holds, and however many tiles each of them
// touches.
TEST(Memory, OfABinIsBoundedByItsRuns) {
  Scene scene = test::BallScene(4000, 64);
  scene.material.radius = 3.0F;
  scene.shadow.technique = ShadowTechniqueKind::kParticleShadowMap;
  scene.shadow.slices = 1;
  scene.shadow.light_buffer_size = 256;
  scene.shadow.fit_degree = 4;
  const ParticleView particles(scene);
  const Traversal traversal = PlanLight(scene, particles, 0);
  const auto peak_with = [&](const RunLimits& limits) {
    return PeakOf([&] { EXPECT_TRUE(FitLight(scene, particles, traversal, {}, limits).ok()); });
  };
  const size_t whole = peak_with({.rects = 4000, .entries = 1U << 20U});
  const size_t in_runs = peak_with({.rects = 4000, .entries = 2000});
  EXPECT_LT(in_runs, whole / 2) << whole;
}

}  // namespace
}  // namespace halflight::sweep
