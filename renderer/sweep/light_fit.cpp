#include "renderer/sweep/light_fit.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include "renderer/light_spread.h"
#include "renderer/parallel.h"
#include "renderer/particle_order.h"
#include "renderer/sweep/kernels.h"
#include "renderer/sweep/light_planes.h"
#include "renderer/sweep/light_slabs.h"
#include "renderer/sweep/polynomial.h"
#include "renderer/sweep/sprites.h"
#include "renderer/sweep/tile_work.h"

namespace halflight::sweep {

namespace {

// Particles of a tile that are swept before they are fitted: their sums stay in a core's cache.
constexpr size_t kBatch = 512;

// A tile of the light buffer's planes, at hand while its particles are swept.
class TileOfPlanes {
 public:
  TileOfPlanes(LightPlanes& planes, const glm::ivec2& corner) : planes_(planes), corner_(corner) {
    if (std::max(corner.x, corner.y) + kLightTile > planes.size) {
      std::fill(std::begin(depth_), std::end(depth_), 0.0F);
      std::fill(std::begin(unscattered_), std::end(unscattered_), 0.0F);
    }
    for (size_t c = 0; c < planes_.depth.size(); ++c) Copy(planes_.depth[c], depth(c), true);
    if (!planes_.unscattered.empty()) Copy(planes_.unscattered, unscattered_, true);
  }
  void Write() {
    for (size_t c = 0; c < planes_.depth.size(); ++c) Copy(planes_.depth[c], depth(c), false);
    if (!planes_.unscattered.empty()) Copy(planes_.unscattered, unscattered_, false);
  }

  float* depth(size_t channel) { return depth_ + channel * kLightTileTexels; }
  float* unscattered() { return planes_.unscattered.empty() ? nullptr : unscattered_; }

 private:
  void Copy(std::vector<float>& plane, float* tile, bool read) const {
    const size_t bytes = std::min(kLightTile, planes_.size - corner_.x) * sizeof(float);
    for (int row = 0; row < std::min(kLightTile, planes_.size - corner_.y); ++row) {
      float* const texels =
          &plane[static_cast<size_t>(corner_.y + row) * planes_.pitch + corner_.x];
      float* const here = tile + static_cast<ptrdiff_t>(row) * kLightTile;
      read ? std::memcpy(here, texels, bytes) : std::memcpy(texels, here, bytes);
    }
  }

  LightPlanes& planes_;
  glm::ivec2 corner_;
  alignas(64) float depth_[3 * kLightTileTexels];
  alignas(64) float unscattered_[kLightTileTexels];
};

// Sweeps one light's particles run by run, and fits each run when all of its tiles are swept.
class Sweep {
 public:
  // `places`: of a particle shadow map, as in UniformSlabs; else null.
  Sweep(const SpriteList& list, const Material& material, const float* places, LightPlanes& planes,
        LightFit& fit)
      : list_(list),
        shape_{fit.projection.orthographic, material.profile == Profile::kBall},
        met_(planes.unscattered.empty() ? 1.0F : static_cast<float>(ForwardExtinction(material))),
        places_(places),
        terms_(static_cast<size_t>(Terms(fit.degree))),
        sums_((1 + static_cast<size_t>(fit.channels)) * terms_),
        disc_(material.profile, fit.degree),
        planes_(planes),
        fit_(fit) {}

  // Call with runs in order. False when `stop` ended it early.
  bool SweepRun(const TileRun& run, const std::stop_token& stop) {
    const std::span<const Rect> rects = std::span(list_.rects).subspan(run.begin, run.size());
    const TileLists tiles = ListTiles(rects, fit_.projection.size, kLightTile);
    std::vector<size_t> part_begin = PartsOf(rects);
    Block<float> parts(part_begin.back() * sums_);
    const std::vector<uint32_t> longest_first = LongestFirst(tiles);
    const bool done = ForTiles(longest_first.size(), stop, [&](size_t turn) {
      SweepTile(tiles, longest_first[turn], run, part_begin, parts);
    });
    if (done) FitParts(run, part_begin, parts);
    return done;
  }

 private:
  // Where the sums of each rectangle that lies across tiles begin; the others have none.
  static std::vector<size_t> PartsOf(std::span<const Rect> rects) {
    std::vector<size_t> begin(rects.size() + 1, 0);
    for (size_t i = 0; i < rects.size(); ++i) {
      const size_t tiles = TilesOf(rects[i], kLightTile).count();
      begin[i + 1] = begin[i] + (tiles > 1 ? tiles : 0);
    }
    return begin;
  }

  void SweepTile(const TileLists& tiles, size_t tile, const TileRun& run,
                 const std::vector<size_t>& part_begin, Block<float>& parts) const {
    const size_t begin = tiles.begin[tile];
    const size_t end = tiles.begin[tile + 1];
    if (begin == end) return;
    const glm::ivec2 at(static_cast<int>(tile % tiles.tiles.x),
                        static_cast<int>(tile / tiles.tiles.x));
    const glm::ivec2 corner = at * kLightTile;
    TileOfPlanes planes(planes_, corner);
    std::array<LightEntry, kBatch> entries;
    std::vector<float> moments(std::min(kBatch, end - begin) * sums_);
    LightTileJob job;
    job.shape = shape_;
    job.grid = GridFrom(fit_.projection, corner.x, corner.y);
    job.sprites = list_.sprites.data() + run.begin;
    job.entries = entries.data();
    job.degree = fit_.degree;
    job.channels = fit_.channels;
    job.met = met_;
    job.moments = moments.data();
    job.depth = planes.depth(0);
    const auto for_batches = [&](const auto& work) {
      for (size_t first = begin; first < end; first += kBatch) {
        job.entry_count = static_cast<uint32_t>(std::min(kBatch, end - first));
        for (uint32_t k = 0; k < job.entry_count; ++k) {
          const uint32_t item = tiles.entries[first + k];
          entries[k] = EntryOf(list_.rects[run.begin + item], item, k, corner);
        }
        work();
      }
    };
    const auto keep_moments = [&] {
      for (uint32_t k = 0; k < job.entry_count; ++k) {
        const uint32_t item = entries[k].sprite;
        const float* const sums = &moments[k * sums_];
        const size_t part = part_begin[item];
        if (part == part_begin[item + 1]) {
          FitParticle(run.begin + item, sums);
          continue;
        }
        const TileRange range = TilesOf(list_.rects[run.begin + item], kLightTile);
        const auto of_tile = static_cast<size_t>(
            (at.y - range.y_begin) * (range.x_end - range.x_begin) + at.x - range.x_begin);
        std::copy_n(sums, sums_, &parts[(part + of_tile) * sums_]);
      }
    };
    if (places_ == nullptr) {
      for_batches([&] {
        BestKernels().sweep_light_tile(job);
        if (planes.unscattered() != nullptr) {
          BestKernels().deposit_light_tile(job, planes.unscattered());
        }
        keep_moments();
      });
    } else {
      alignas(64) float slab[kLightTileTexels] = {};
      for_batches([&] { BestKernels().deposit_light_tile(job, slab); });
      job.slab = slab;
      job.places = places_ + run.begin;
      for_batches([&] {
        BestKernels().sweep_light_tile(job);
        keep_moments();
      });
      for (int c = 0; c < fit_.channels; ++c) AddTo(planes.depth(c), met_, slab);
      if (planes.unscattered() != nullptr) AddTo(planes.unscattered(), 1.0F, slab);
    }
    planes.Write();
  }

  static void AddTo(float* depth, float share, const float* slab) {
    for (int i = 0; i < kLightTileTexels; ++i) depth[i] += share * slab[i];
  }

  static LightEntry EntryOf(const Rect& rect, uint32_t item, uint32_t moments,
                            const glm::ivec2& corner) {
    const auto within = [](int value, int first) {
      return static_cast<uint8_t>(std::clamp(value - first, 0, kLightTile));
    };
    return {item,
            moments,
            within(rect.x_begin, corner.x),
            within(rect.x_end, corner.x),
            within(rect.y_begin, corner.y),
            within(rect.y_end, corner.y)};
  }

  void FitParts(const TileRun& run, const std::vector<size_t>& part_begin,
                const Block<float>& parts) const {
    ParallelRanges(run.size(), [&](const WorkRange& range) {
      for (size_t item = range.begin; item < range.end; ++item) {
        if (part_begin[item] == part_begin[item + 1]) continue;
        std::array<float, 4 * Terms(kMaxDegree)> sums = {};
        for (size_t part = part_begin[item]; part < part_begin[item + 1]; ++part) {
          for (size_t i = 0; i < sums_; ++i) sums[i] += parts[part * sums_ + i];
        }
        FitParticle(run.begin + item, sums.data());
      }
    });
  }

  void FitParticle(size_t place, const float* sums) const {
    const auto channels = static_cast<size_t>(fit_.channels);
    for (size_t c = 0; c < channels; ++c) {
      disc_.Fit({sums, terms_}, {sums + (1 + c) * terms_, terms_},
                {&fit_.depth[(list_.particles[place] * channels + c) * terms_], terms_});
    }
  }

  const SpriteList& list_;
  TargetShape shape_;
  float met_;
  const float* places_;
  size_t terms_;
  size_t sums_;  // floats of a particle's sums
  DiscFit disc_;
  LightPlanes& planes_;
  LightFit& fit_;
};

// Puts a layer of the same size behind those that are there, or begins them.
void AppendLayer(Image layer, Image& layers) {
  if (layers.pixels.empty()) {
    layers = std::move(layer);
    return;
  }
  layers.pixels.insert(layers.pixels.end(), layer.pixels.begin(), layer.pixels.end());
  ++layers.layers;
}

// Runs of one slab; all of it, where a particle sees the layer behind it.
std::vector<TileRun> RunsOf(const SpriteList& list, const TileRun& slab, bool layered,
                            const RunLimits& limits) {
  if (layered && slab.size() > 0) return {slab};
  std::vector<TileRun> runs =
      CutIntoRuns(std::span(list.rects).subspan(slab.begin, slab.size()), kLightTile, limits);
  for (TileRun& run : runs) {
    run.begin += slab.begin;
    run.end += slab.begin;
  }
  return runs;
}

}  // namespace

Traversal PlanLight(const Scene& scene, const ParticleView& particles, int light,
                    bool keep_layers) {
  Traversal traversal = PlanLightBuffer(scene, particles, light);
  traversal.axis = TravelDirection(scene.lights[static_cast<size_t>(light)], particles);
  traversal.keep_layers = keep_layers;
  const bool layered = IsLayered(scene);
  if (!traversal.blur && !keep_layers && !layered) traversal.slices = 1;
  if (layered || traversal.slices == 1) traversal.spacing = SliceSpacing::kEqualCount;
  return traversal;
}

absl::StatusOr<LightFit> FitLight(const Scene& scene, const ParticleView& particles,
                                  const Traversal& traversal, const std::stop_token& stop,
                                  const RunLimits& limits) {
  const Light& light = scene.lights[static_cast<size_t>(*traversal.shadow_light)];
  const int size = traversal.light_buffer_size;
  std::optional<LightSpread> spread;
  if (traversal.blur) spread.emplace(scene, light, particles, *traversal.axis);
  LightFit fit;
  fit.projection = LightProjection(light, particles, size, spread ? spread->Border() : 0.0);
  fit.degree = scene.shadow.fit_degree;
  fit.channels = traversal.colored_light_buffer ? 3 : 1;
  const SpriteList list = ListSprites(particles, fit.projection);
  fit.depth.resize(particles.size() * static_cast<size_t>(fit.channels * Terms(fit.degree)));

  const bool layered = IsLayered(scene);
  const LightWay way(light, particles);
  UniformSlabs cut;
  if (layered) {
    cut = CutLightUniformly(way, list.particles, traversal.slices);
  } else {
    cut.begin = CutIntoSlices(particles, list.particles, traversal.slices, traversal.spacing);
  }
  SlabPositions positions;
  if (spread) positions = PlaceSlabs(way, list.particles, cut.begin);

  LightPlanes planes(size, traversal.colored_light_buffer, traversal.keep_unscattered);
  const glm::dvec2 texels_per_unit = TexelsPerUnit(fit.projection, particles);
  const auto blur = [&](double from, double to) {
    BlurPlanes(spread->InTexels(from, to, texels_per_unit), light.shadow_density, planes);
  };
  Sweep sweep(list, scene.material, layered ? cut.places.data() : nullptr, planes, fit);
  for (size_t s = 0; s + 1 < cut.begin.size(); ++s) {
    if (spread && s > 0) blur(positions.middle[s - 1], positions.middle[s]);
    const TileRun slab{cut.begin[s], cut.begin[s + 1]};
    for (const TileRun& run : RunsOf(list, slab, layered, limits)) {
      if (!sweep.SweepRun(run, stop)) return absl::CancelledError("frame cancelled");
    }
    if (traversal.keep_layers) AppendLayer(planes.ToImage(), fit.layers);
  }
  // The buffer stands at the middle of the last slab; shown is the light behind all particles.
  if (spread) blur(positions.middle.back(), positions.end);
  fit.optical_depth = std::move(planes).TakeImage();
  return fit;
}

}  // namespace halflight::sweep
