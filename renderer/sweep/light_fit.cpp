#include "renderer/sweep/light_fit.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "renderer/parallel.h"
#include "renderer/sweep/polynomial.h"
#include "renderer/sweep/sprites.h"
#include "renderer/sweep/tile_work.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

absl::StatusOr<LightFit> FitLight(const Light& light, const ParticleView& particles,
                                  Profile profile, int light_buffer_size, int degree,
                                  const std::stop_token& stop) {
  LightFit fit;
  fit.projection = LightProjection(light, particles, light_buffer_size, 0.0);
  SpriteList list = ListSprites(particles, fit.projection);
  const TileLists tiles = ListTiles(list.rects, fit.projection.size, kLightTile);
  fit.optical_depth = {light_buffer_size, light_buffer_size, 1, {"Y"}, {}};
  fit.optical_depth.pixels.resize(static_cast<size_t>(light_buffer_size) * light_buffer_size);

  // Sweep every tile through its particles.
  const auto terms = static_cast<size_t>(Terms(degree));
  Block<float> moments(tiles.entries.size() * 2 * terms);
  const TargetShape shape{fit.projection.orthographic, profile == Profile::kBall};
  const std::vector<uint32_t> longest_first = LongestFirst(tiles);
  const bool done = ForTiles(longest_first.size(), stop, [&](size_t turn) {
    const size_t tile = longest_first[turn];
    const int x = static_cast<int>(tile % tiles.tiles.x) * kLightTile;
    const int y = static_cast<int>(tile / tiles.tiles.x) * kLightTile;
    std::vector<LightEntry> entries;
    entries.reserve(tiles.begin[tile + 1] - tiles.begin[tile]);
    for (size_t e = tiles.begin[tile]; e < tiles.begin[tile + 1]; ++e) {
      const TileEntry& entry = tiles.entries[e];
      const Rect& rect = list.rects[entry.item];
      const auto within = [](int value, int first) {
        return static_cast<uint8_t>(std::clamp(value - first, 0, kLightTile));
      };
      entries.push_back({entry.item, entry.part, within(rect.x_begin, x), within(rect.x_end, x),
                         within(rect.y_begin, y), within(rect.y_end, y)});
    }
    alignas(64) float depth[kLightTile * kLightTile] = {};
    LightTileJob job;
    job.shape = shape;
    job.grid = GridFrom(fit.projection, x, y);
    job.sprites = list.sprites.data();
    job.entries = entries.data();
    job.entry_count = static_cast<uint32_t>(entries.size());
    job.degree = degree;
    job.moments = moments.data();
    job.depth = depth;
    BestKernels().sweep_light_tile(job);
    const int columns = std::min(kLightTile, light_buffer_size - x);
    for (int row = 0; row < std::min(kLightTile, light_buffer_size - y); ++row) {
      std::memcpy(&fit.optical_depth.pixels[static_cast<size_t>(y + row) * light_buffer_size + x],
                  depth + static_cast<ptrdiff_t>(row) * kLightTile, columns * sizeof(float));
    }
  });
  if (!done) return absl::CancelledError("frame cancelled");

  // Fit.
  fit.degree = degree;
  fit.depth.resize(particles.size() * terms);
  fit.sprites.resize(particles.size());
  const DiscFit disc(profile, degree);
  ParallelRanges(particles.size(), [&](const WorkRange& range) {
    for (size_t place = range.begin; place < range.end; ++place) {
      std::array<float, 2 * Terms(kMaxDegree)> sums = {};
      for (uint32_t part = tiles.part_begin[place]; part < tiles.part_begin[place + 1]; ++part) {
        for (size_t i = 0; i < 2 * terms; ++i) sums[i] += moments[part * 2 * terms + i];
      }
      const uint32_t i = list.particles[place];
      disc.Fit({sums.data(), terms}, {sums.data() + terms, terms}, {&fit.depth[i * terms], terms});
      fit.sprites[i] = list.sprites[place];
    }
  });
  return fit;
}

}  // namespace halflight::sweep
