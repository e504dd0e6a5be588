#include "renderer/sweep/compositor.h"

#include <algorithm>
#include <array>

#include "renderer/sweep/tile_work.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

namespace {

constexpr float kLeastTransmittance = 1e-6F;
constexpr int kPlane = kImageTile * kImageTile;

Image MakeTarget(const glm::ivec2& size) {
  Image image{size.x, size.y, 1, {"R", "G", "B", "A"}, {}};
  image.pixels.resize(static_cast<size_t>(size.x) * size.y * 4);
  return image;
}

// Writes planes of a tile at `corner` as channels of an image; a null plane is 0.
void WriteTile(const std::array<const float*, 4>& planes, const glm::ivec2& corner, Image& image) {
  const int rows = std::min(kImageTile, image.height - corner.y);
  const int columns = std::min(kImageTile, image.width - corner.x);
  for (int row = 0; row < rows; ++row) {
    float* out = &image.pixels[(static_cast<size_t>(corner.y + row) * image.width + corner.x) * 4];
    for (int i = row * kImageTile; i < row * kImageTile + columns; ++i) {
      for (const float* plane : planes) *out++ = plane != nullptr ? plane[i] : 0.0F;
    }
  }
}

}  // namespace

absl::StatusOr<Composite> CompositeTiles(const SpriteList& list, const Shading& shading,
                                         const Projection& eye, Profile profile,
                                         bool keep_transmittance, const std::stop_token& stop) {
  const TileLists tiles = ListTiles(list.rects, eye.size, kImageTile);
  const size_t lights = keep_transmittance ? shading.lights.size() : 0;
  Composite composite;
  composite.beauty = MakeTarget(eye.size);
  if (!shading.depth.empty()) composite.depth = MakeTarget(eye.size);
  composite.transmittance.assign(lights, MakeTarget(eye.size));

  const bool done = ForTiles(tiles.begin.size() - 1, stop, [&](size_t tile) {
    const auto [begin, end] = std::pair(tiles.begin[tile], tiles.begin[tile + 1]);
    if (begin == end) return;
    const auto across = static_cast<size_t>(tiles.tiles.x);
    const glm::ivec2 corner =
        glm::ivec2(static_cast<int>(tile % across), static_cast<int>(tile / across)) * kImageTile;
    std::vector<uint32_t> entries;
    entries.reserve(end - begin);
    for (size_t e = begin; e < end; ++e) entries.push_back(tiles.entries[e].item);
    std::array<float, 4 * kPlane> pixels = {};
    std::array<float, kPlane> depth = {};
    std::vector<float> transmittance(3 * kPlane * lights, 0.0F);

    ImageTileJob job;
    job.shape = {eye.orthographic, profile == Profile::kBall};
    job.grid = GridFrom(eye, corner.x, corner.y);
    job.shaded = shading.View(list);
    job.entries = entries.data();
    job.entry_count = static_cast<uint32_t>(entries.size());
    job.first_row = corner.y;
    job.least_transmittance = kLeastTransmittance;
    job.pixels = pixels.data();
    job.depth = shading.depth.empty() ? nullptr : depth.data();
    job.transmittance = lights > 0 ? transmittance.data() : nullptr;
    BestKernels().composite_image_tile(job);

    const float* const coverage = &pixels[3 * kPlane];
    WriteTile({pixels.data(), &pixels[kPlane], &pixels[2 * kPlane], coverage}, corner,
              composite.beauty);
    if (job.depth != nullptr) {
      WriteTile({depth.data(), nullptr, nullptr, coverage}, corner, composite.depth);
    }
    for (size_t l = 0; l < lights; ++l) {
      const float* const planes = &transmittance[l * 3 * kPlane];
      WriteTile({planes, planes + kPlane, planes + 2 * kPlane, coverage}, corner,
                composite.transmittance[l]);
    }
  });
  if (!done) return absl::CancelledError("frame cancelled");
  return composite;
}

}  // namespace halflight::sweep
