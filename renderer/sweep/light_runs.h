// The particles of a light, run by run: what light met before each over its own footprint, fitted,
// and what they take of it, deposited in the light buffer's planes.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "renderer/block_cache.h"
#include "renderer/scene.h"
#include "renderer/sweep/kernels.h"
#include "renderer/sweep/light_fit.h"
#include "renderer/sweep/light_planes.h"
#include "renderer/sweep/polynomial.h"
#include "renderer/sweep/sprites.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

class LightRuns {
 public:
  // `places`: of a particle shadow map, as in UniformSlabs; else null. All outlive it.
  LightRuns(const SpriteList& list, const Material& material, const float* places,
            LightPlanes& planes, LightFit& fit);

  // One slab's runs, slabs in order. Of a particle shadow map every particle sees what all of its
  // slab deposits; else what those before it do. False when `stop` ended it early.
  bool SweepSlab(std::span<const TileRun> runs, const std::stop_token& stop);

 private:
  // What is done with a run of a slab of which particles see all: both at once, or where it has
  // several runs first one for all of them, then the other.
  enum class Pass { kWhole, kDeposit, kFit };

  struct Tile {
    size_t index;
    const TileLists& lists;
    const TileRun& run;
    std::span<const size_t> part_begin;
    Block<float>& parts;
  };

  bool SweepRun(const TileRun& run, Pass pass, const std::stop_token& stop);
  void SweepTile(const Tile& tile, Pass pass);
  void AddSlab();
  void FitParts(const TileRun& run, std::span<const size_t> part_begin, const Block<float>& parts);
  void FitParticle(size_t place, const float* sums);

  const SpriteList& list_;
  TargetShape shape_;
  float met_;
  const float* places_;
  size_t terms_;
  size_t sums_;  // floats of a particle's sums
  DiscFit disc_;
  LightPlanes& planes_;
  LightFit& fit_;
  // What a slab of several runs has deposited so far, like a plane; zeros between slabs.
  std::vector<float> slab_;
};

}  // namespace halflight::sweep
