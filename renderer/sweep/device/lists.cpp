#include "renderer/sweep/device/lists.h"

#include <bit>
#include <cstdint>
#include <vector>

#include <glm/vec4.hpp>

namespace halflight::sweep {

// What is uploaded as it is.
static_assert(sizeof(Sprite) == sizeof(glm::vec4));
static_assert(sizeof(Rect) == sizeof(glm::uvec2) && std::endian::native == std::endian::little);

size_t DeviceSprites::bytes() const {
  return count * (sizeof(uint32_t) + sizeof(glm::vec4) + sizeof(glm::uvec2) +
                  (has_near ? sizeof(glm::vec4) : 0));
}

size_t DeviceTiles::bytes() const {
  const auto tile_count = static_cast<size_t>(tiles.x) * static_cast<size_t>(tiles.y);
  return (tile_count + 1 + entry_count) * sizeof(uint32_t);
}

DeviceSprites UploadSprites(const SpriteList& list) {
  DeviceSprites device;
  device.count = list.particles.size();
  device.particles = gl::MakeBuffer("sorted particles", list.particles);
  device.sprites = gl::MakeBuffer("sprites", list.sprites);
  device.rects = gl::MakeBuffer("sprite rectangles", list.rects);
  device.has_near = !list.near.empty();
  if (device.has_near) {
    std::vector<glm::vec4> near;
    near.reserve(list.near.size());
    for (const NearSprite& sprite : list.near) {
      near.emplace_back(sprite.center[0], sprite.center[1], sprite.center[2], 0.0F);
    }
    device.near = gl::MakeBuffer("near sprites", near);
  }
  return device;
}

DeviceTiles UploadTiles(const TileLists& lists) {
  DeviceTiles device;
  device.tiles = lists.tiles;
  device.tile_size = lists.tile_size;
  device.begin =
      gl::MakeBuffer("tile begins", std::vector<uint32_t>(lists.begin.begin(), lists.begin.end()));
  device.entries = gl::MakeBuffer("tile entries", lists.entries);
  device.entry_count = lists.entries.size();
  return device;
}

}  // namespace halflight::sweep
