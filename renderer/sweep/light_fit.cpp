#include "renderer/sweep/light_fit.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include "renderer/parallel.h"
#include "renderer/sweep/kernels.h"
#include "renderer/sweep/polynomial.h"
#include "renderer/sweep/sprites.h"
#include "renderer/sweep/tile_work.h"

namespace halflight::sweep {

namespace {

// Particles of a tile that are swept before they are fitted: their sums stay in a core's cache.
constexpr size_t kBatch = 512;

// Sweeps one light's particles run by run, and fits each run when all of its tiles are swept.
class Sweep {
 public:
  Sweep(const SpriteList& list, Profile profile, LightFit& fit)
      : list_(list),
        shape_{fit.projection.orthographic, profile == Profile::kBall},
        terms_(static_cast<size_t>(Terms(fit.degree))),
        disc_(profile, fit.degree),
        fit_(fit) {}

  // Call with runs in order. False when `stop` ended it early.
  bool SweepRun(const TileRun& run, const std::stop_token& stop) {
    const std::span<const Rect> rects = std::span(list_.rects).subspan(run.begin, run.size());
    const TileLists tiles = ListTiles(rects, fit_.projection.size, kLightTile);
    std::vector<size_t> part_begin = PartsOf(rects);
    Block<float> parts(part_begin.back() * 2 * terms_);
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
    alignas(64) float depth[kLightTile * kLightTile] = {};
    CopyRows(corner, [&](float* texels, ptrdiff_t row, size_t bytes) {
      std::memcpy(depth + row * kLightTile, texels, bytes);
    });

    std::array<LightEntry, kBatch> entries;
    std::vector<float> moments(std::min(kBatch, end - begin) * 2 * terms_);
    LightTileJob job;
    job.shape = shape_;
    job.grid = GridFrom(fit_.projection, corner.x, corner.y);
    job.sprites = list_.sprites.data() + run.begin;
    job.entries = entries.data();
    job.degree = fit_.degree;
    job.moments = moments.data();
    job.depth = depth;
    for (size_t first = begin; first < end; first += kBatch) {
      job.entry_count = static_cast<uint32_t>(std::min(kBatch, end - first));
      for (uint32_t k = 0; k < job.entry_count; ++k) {
        const uint32_t item = tiles.entries[first + k];
        entries[k] = EntryOf(list_.rects[run.begin + item], item, k, corner);
      }
      BestKernels().sweep_light_tile(job);
      for (uint32_t k = 0; k < job.entry_count; ++k) {
        const uint32_t item = entries[k].sprite;
        const float* const sums = &moments[k * 2 * terms_];
        const size_t part = part_begin[item];
        if (part == part_begin[item + 1]) {
          FitParticle(run.begin + item, sums);
          continue;
        }
        const TileRange range = TilesOf(list_.rects[run.begin + item], kLightTile);
        const auto of_tile = static_cast<size_t>(
            (at.y - range.y_begin) * (range.x_end - range.x_begin) + at.x - range.x_begin);
        std::copy_n(sums, 2 * terms_, &parts[(part + of_tile) * 2 * terms_]);
      }
    }
    CopyRows(corner, [&](float* texels, ptrdiff_t row, size_t bytes) {
      std::memcpy(texels, depth + row * kLightTile, bytes);
    });
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

  // Calls `copy` for the part of each row of a tile that lies in the light buffer.
  template <typename Copy>
  void CopyRows(const glm::ivec2& corner, const Copy& copy) const {
    const int size = fit_.optical_depth.width;
    const size_t bytes = std::min(kLightTile, size - corner.x) * sizeof(float);
    for (int row = 0; row < std::min(kLightTile, size - corner.y); ++row) {
      copy(&fit_.optical_depth.pixels[static_cast<size_t>(corner.y + row) * size + corner.x], row,
           bytes);
    }
  }

  void FitParts(const TileRun& run, const std::vector<size_t>& part_begin,
                const Block<float>& parts) const {
    ParallelRanges(run.size(), [&](const WorkRange& range) {
      for (size_t item = range.begin; item < range.end; ++item) {
        if (part_begin[item] == part_begin[item + 1]) continue;
        std::array<float, 2 * Terms(kMaxDegree)> sums = {};
        for (size_t part = part_begin[item]; part < part_begin[item + 1]; ++part) {
          for (size_t i = 0; i < 2 * terms_; ++i) sums[i] += parts[part * 2 * terms_ + i];
        }
        FitParticle(run.begin + item, sums.data());
      }
    });
  }

  void FitParticle(size_t place, const float* sums) const {
    disc_.Fit({sums, terms_}, {sums + terms_, terms_},
              {&fit_.depth[list_.particles[place] * terms_], terms_});
  }

  const SpriteList& list_;
  TargetShape shape_;
  size_t terms_;
  DiscFit disc_;
  LightFit& fit_;
};

}  // namespace

absl::StatusOr<LightFit> FitLight(const Light& light, const ParticleView& particles,
                                  Profile profile, int light_buffer_size, int degree,
                                  const std::stop_token& stop, const RunLimits& limits) {
  LightFit fit;
  fit.projection = LightProjection(light, particles, light_buffer_size, 0.0);
  fit.degree = degree;
  const SpriteList list = ListSprites(particles, fit.projection);
  fit.depth.resize(particles.size() * static_cast<size_t>(Terms(degree)));
  fit.optical_depth = {light_buffer_size, light_buffer_size, 1, {"Y"}, {}};
  fit.optical_depth.pixels.resize(static_cast<size_t>(light_buffer_size) * light_buffer_size);
  Sweep sweep(list, profile, fit);
  for (const TileRun& run : CutIntoRuns(list.rects, kLightTile, limits)) {
    if (!sweep.SweepRun(run, stop)) return absl::CancelledError("frame cancelled");
  }
  return fit;
}

}  // namespace halflight::sweep
