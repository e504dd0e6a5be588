#include "renderer/sweep/compositor.h"

#include <algorithm>
#include <array>

#include "renderer/pixel_memory.h"
#include "renderer/sweep/tile_work.h"

namespace halflight::sweep {

namespace {

constexpr float kLeastTransmittance = 1e-6F;
constexpr int kPlane = kImageTile * kImageTile;

Image MakeTarget(const glm::ivec2& size, const std::stop_token& stop) {
  Image image{size.x, size.y, 1, {"R", "G", "B", "A"}, {}};
  image.pixels = Zeros(static_cast<size_t>(size.x) * size.y * 4, stop);
  return image;
}

// Calls `visit(channels, i)` for every pixel of the tile at `corner` that the image has: its four
// channels, and its place in a plane.
template <typename Visit>
void ForPixelsOf(const glm::ivec2& corner, Image& image, const Visit& visit) {
  const int rows = std::min(kImageTile, image.height - corner.y);
  const int columns = std::min(kImageTile, image.width - corner.x);
  for (int row = 0; row < rows; ++row) {
    float* pixel =
        &image.pixels[(static_cast<size_t>(corner.y + row) * image.width + corner.x) * 4];
    for (int i = row * kImageTile; i < row * kImageTile + columns; ++i, pixel += 4) visit(pixel, i);
  }
}

// Planes of a tile as channels of an image, and back; a null plane is 0.
using Planes = std::array<float*, 4>;

void ReadTile(const glm::ivec2& corner, Image& image, const Planes& planes) {
  ForPixelsOf(corner, image, [&](const float* pixel, int i) {
    for (size_t c = 0; c < planes.size(); ++c) {
      if (planes[c] != nullptr) planes[c][i] = pixel[c];
    }
  });
}

void WriteTile(const Planes& planes, const glm::ivec2& corner, Image& image) {
  ForPixelsOf(corner, image, [&](float* pixel, int i) {
    for (size_t c = 0; c < planes.size(); ++c) {
      pixel[c] = planes[c] != nullptr ? planes[c][i] : 0.0F;
    }
  });
}

}  // namespace

Composite MakeComposite(const glm::ivec2& size, bool keep_depth, size_t slots,
                        const std::stop_token& stop) {
  Composite composite;
  composite.beauty = MakeTarget(size, stop);
  if (keep_depth) composite.depth = MakeTarget(size, stop);
  composite.transmittance.resize(slots);
  for (Image& image : composite.transmittance) image = MakeTarget(size, stop);
  return composite;
}

bool CompositeRun(const SpriteList& list, const TileLists& tiles, const Shading& shading,
                  const Projection& eye, Profile profile, const std::stop_token& stop,
                  Composite& composite) {
  const size_t slots = composite.transmittance.size();
  return ForTiles(tiles.begin.size() - 1, stop, [&](size_t tile) {
    const size_t begin = tiles.begin[tile];
    const size_t end = tiles.begin[tile + 1];
    if (begin == end) return;
    const auto across = static_cast<size_t>(tiles.tiles.x);
    const glm::ivec2 corner =
        glm::ivec2(static_cast<int>(tile % across), static_cast<int>(tile / across)) * kImageTile;
    std::array<float, 4 * kPlane> pixels = {};
    std::array<float, kPlane> depth = {};
    std::vector<float> transmittance(3 * kPlane * slots, 0.0F);
    const auto planes_of_depth = [&](float* coverage) {
      return Planes{depth.data(), nullptr, nullptr, coverage};
    };
    const auto planes_of_slot = [&](size_t slot, float* coverage) {
      float* const planes = &transmittance[slot * 3 * kPlane];
      return Planes{planes, planes + kPlane, planes + 2 * kPlane, coverage};
    };
    const Planes beauty = {pixels.data(), &pixels[kPlane], &pixels[2 * kPlane],
                           &pixels[3 * kPlane]};
    ReadTile(corner, composite.beauty, beauty);
    if (!shading.depth.empty()) ReadTile(corner, composite.depth, planes_of_depth(nullptr));
    for (size_t slot = 0; slot < slots; ++slot) {
      ReadTile(corner, composite.transmittance[slot], planes_of_slot(slot, nullptr));
    }

    ImageTileJob job;
    job.shape = {eye.orthographic, profile == Profile::kBall};
    job.grid = GridFrom(eye, corner.x, corner.y);
    job.shaded = shading.View(list);
    job.entries = &tiles.entries[begin];
    job.entry_count = static_cast<uint32_t>(end - begin);
    job.first_row = corner.y;
    job.least_transmittance = kLeastTransmittance;
    job.pixels = pixels.data();
    job.depth = shading.depth.empty() ? nullptr : depth.data();
    job.transmittance = slots > 0 ? transmittance.data() : nullptr;
    BestKernels().composite_image_tile(job);

    WriteTile(beauty, corner, composite.beauty);
    if (job.depth != nullptr) WriteTile(planes_of_depth(beauty[3]), corner, composite.depth);
    for (size_t slot = 0; slot < slots; ++slot) {
      WriteTile(planes_of_slot(slot, beauty[3]), corner, composite.transmittance[slot]);
    }
  });
}

}  // namespace halflight::sweep
