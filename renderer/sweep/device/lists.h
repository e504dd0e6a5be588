// Sorted particles and tile lists in buffers of the device, for the passes of the light sweep
// there. Shades nothing.
#pragma once

#include <cstddef>

#include <glm/vec2.hpp>

#include "renderer/gl/object.h"
#include "renderer/sweep/sprites.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

// A SpriteList. All buffers are by place in the order: nearest the eye or the light first.
struct DeviceSprites {
  size_t count = 0;
  gl::Buffer particles;  // uint: index in the set
  gl::Buffer sprites;    // vec4: x, y, scale, optical depth, as in Sprite
  gl::Buffer rects;      // uvec2: x_begin | x_end << 16, y_begin | y_end << 16
  bool has_near = false;
  gl::Buffer near;  // vec4: centre in radii of those whose scale is 0; only where has_near
};

// TileLists.
struct DeviceTiles {
  glm::ivec2 tiles{0};
  int tile_size = 0;  // pixels along each side
  // uint[tiles.x * tiles.y + 1]: tile t (row by row) has entries [begin[t], begin[t + 1]).
  gl::Buffer begin;
  gl::Buffer entries;  // uint: place, ascending within a tile
  size_t entry_count = 0;
};

// Copy lists made on the CPU. Need a current context.
DeviceSprites UploadSprites(const SpriteList& list);
DeviceTiles UploadTiles(const TileLists& lists);

}  // namespace halflight::sweep
