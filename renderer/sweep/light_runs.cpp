#include "renderer/sweep/light_runs.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>

#include "renderer/parallel.h"
#include "renderer/sweep/tile_work.h"

namespace halflight::sweep {

namespace {

// Particles of a tile that are swept before they are fitted: their sums stay in a core's cache.
constexpr size_t kBatch = 512;

// A tile of planes of the light buffer, at hand while its particles are swept.
class TileOfPlanes {
 public:
  TileOfPlanes(LightPlanes& planes, const glm::ivec2& corner) : planes_(planes), corner_(corner) {
    for (size_t c = 0; c < planes_.depth.size(); ++c) Read(planes_.depth[c], depth(c));
    if (!planes_.unscattered.empty()) Read(planes_.unscattered, unscattered_);
  }
  void Write() {
    for (size_t c = 0; c < planes_.depth.size(); ++c) Write(depth(c), planes_.depth[c]);
    if (!planes_.unscattered.empty()) Write(unscattered_, planes_.unscattered);
  }

  float* depth(size_t channel) { return depth_ + channel * kLightTileTexels; }
  float* unscattered() { return planes_.unscattered.empty() ? nullptr : unscattered_; }

  // Of one plane; zeros beyond it.
  void Read(const std::vector<float>& plane, float* tile) const {
    if (std::max(corner_.x, corner_.y) + kLightTile > planes_.size) {
      std::fill_n(tile, kLightTileTexels, 0.0F);
    }
    ForRows([&](size_t at, float* row, size_t bytes) { std::memcpy(row, &plane[at], bytes); },
            tile);
  }
  void Write(float* tile, std::vector<float>& plane) const {
    ForRows([&](size_t at, const float* row, size_t bytes) { std::memcpy(&plane[at], row, bytes); },
            tile);
  }

 private:
  template <typename Work>
  void ForRows(const Work& work, float* tile) const {
    const size_t bytes = std::min(kLightTile, planes_.size - corner_.x) * sizeof(float);
    for (int row = 0; row < std::min(kLightTile, planes_.size - corner_.y); ++row) {
      work(static_cast<size_t>(corner_.y + row) * planes_.pitch + corner_.x,
           tile + static_cast<ptrdiff_t>(row) * kLightTile, bytes);
    }
  }

  LightPlanes& planes_;
  glm::ivec2 corner_;
  alignas(64) float depth_[3 * kLightTileTexels];
  alignas(64) float unscattered_[kLightTileTexels];
};

// Where the sums of each rectangle that lies across tiles begin; the others have none.
std::vector<size_t> PartsOf(std::span<const Rect> rects) {
  std::vector<size_t> begin(rects.size() + 1, 0);
  for (size_t i = 0; i < rects.size(); ++i) {
    const size_t tiles = TilesOf(rects[i], kLightTile).count();
    begin[i + 1] = begin[i] + (tiles > 1 ? tiles : 0);
  }
  return begin;
}

void AddTo(float* depth, float share, const float* slab, size_t count) {
  for (size_t i = 0; i < count; ++i) depth[i] += share * slab[i];
}

LightEntry EntryOf(const Rect& rect, uint32_t item, uint32_t moments, const glm::ivec2& corner) {
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

}  // namespace

LightRuns::LightRuns(const SpriteList& list, const Material& material, const float* places,
                     LightPlanes& planes, LightFit& fit)
    : list_(list),
      shape_{fit.projection.orthographic, material.profile == Profile::kBall},
      met_(planes.unscattered.empty() ? 1.0F : static_cast<float>(ForwardExtinction(material))),
      places_(places),
      terms_(static_cast<size_t>(Terms(fit.degree))),
      sums_((1 + static_cast<size_t>(fit.channels)) * terms_),
      disc_(material.profile, fit.degree),
      planes_(planes),
      fit_(fit) {}

bool LightRuns::SweepSlab(std::span<const TileRun> runs, const std::stop_token& stop) {
  const auto sweep = [&](Pass pass) {
    return std::all_of(runs.begin(), runs.end(),
                       [&](const TileRun& run) { return SweepRun(run, pass, stop); });
  };
  if (places_ == nullptr || runs.size() < 2) return sweep(Pass::kWhole);
  slab_.resize(planes_.depth.front().size());
  if (!sweep(Pass::kDeposit) || !sweep(Pass::kFit)) return false;
  AddSlab();
  return true;
}

bool LightRuns::SweepRun(const TileRun& run, Pass pass, const std::stop_token& stop) {
  const std::span<const Rect> rects = std::span(list_.rects).subspan(run.begin, run.size());
  const TileLists tiles = ListTiles(rects, fit_.projection.size, kLightTile);
  const bool fits = pass != Pass::kDeposit;
  const std::vector<size_t> part_begin = fits ? PartsOf(rects) : std::vector<size_t>(1);
  Block<float> parts(part_begin.back() * sums_);
  const std::vector<uint32_t> longest_first = LongestFirst(tiles);
  const bool done = ForTiles(longest_first.size(), stop, [&](size_t turn) {
    SweepTile({longest_first[turn], tiles, run, part_begin, parts}, pass);
  });
  if (done && fits) FitParts(run, part_begin, parts);
  return done;
}

void LightRuns::SweepTile(const Tile& tile, Pass pass) {
  const TileLists& tiles = tile.lists;
  const TileRun& run = tile.run;
  const size_t begin = tiles.begin[tile.index];
  const size_t end = tiles.begin[tile.index + 1];
  if (begin == end) return;
  const glm::ivec2 at(static_cast<int>(tile.index % tiles.tiles.x),
                      static_cast<int>(tile.index / tiles.tiles.x));
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
      const size_t part = tile.part_begin[item];
      if (part == tile.part_begin[item + 1]) {
        FitParticle(run.begin + item, sums);
        continue;
      }
      const TileRange range = TilesOf(list_.rects[run.begin + item], kLightTile);
      const auto of_tile = static_cast<size_t>(
          (at.y - range.y_begin) * (range.x_end - range.x_begin) + at.x - range.x_begin);
      std::copy_n(sums, sums_, &tile.parts[(part + of_tile) * sums_]);
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
    planes.Write();
    return;
  }
  alignas(64) float slab[kLightTileTexels] = {};
  if (pass != Pass::kWhole) planes.Read(slab_, slab);
  if (pass != Pass::kFit) for_batches([&] { BestKernels().deposit_light_tile(job, slab); });
  if (pass == Pass::kDeposit) {
    planes.Write(slab, slab_);
    return;
  }
  job.slab = slab;
  job.places = places_ + run.begin;
  for_batches([&] {
    BestKernels().sweep_light_tile(job);
    keep_moments();
  });
  if (pass == Pass::kFit) return;
  for (int c = 0; c < fit_.channels; ++c) AddTo(planes.depth(c), met_, slab, kLightTileTexels);
  if (planes.unscattered() != nullptr) {
    AddTo(planes.unscattered(), 1.0F, slab, kLightTileTexels);
  }
  planes.Write();
}

void LightRuns::AddSlab() {
  ParallelRanges(slab_.size(), [&](const WorkRange& range) {
    const size_t count = range.end - range.begin;
    float* const slab = &slab_[range.begin];
    for (std::vector<float>& depth : planes_.depth) AddTo(&depth[range.begin], met_, slab, count);
    if (!planes_.unscattered.empty()) {
      AddTo(&planes_.unscattered[range.begin], 1.0F, slab, count);
    }
    std::fill_n(slab, count, 0.0F);
  });
}

void LightRuns::FitParts(const TileRun& run, std::span<const size_t> part_begin,
                         const Block<float>& parts) {
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

void LightRuns::FitParticle(size_t place, const float* sums) {
  const auto channels = static_cast<size_t>(fit_.channels);
  for (size_t c = 0; c < channels; ++c) {
    disc_.Fit({sums, terms_}, {sums + (1 + c) * terms_, terms_},
              {&fit_.depth[(list_.particles[place] * channels + c) * terms_], terms_});
  }
}

}  // namespace halflight::sweep
