// Sorted particles and tile lists in buffers of the device, for the passes of the light sweep
// there. Shades nothing.
#pragma once

#include <cstddef>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "absl/status/statusor.h"
#include "renderer/gl/object.h"
#include "renderer/gpu.h"
#include "renderer/projection.h"
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

// Places [first, end) of an order.
struct PlaceRun {
  size_t first = 0;
  size_t end = 0;
};

// ListSprites() of particles on the device, whose offsets are from `origin`. In the same steps of
// float64, so that order, sprites and rectangles are the CPU's, bit for bit where the device rounds
// divisions and roots as IEEE 754 asks and depths are no denormal floats: at any distance from the
// origin. Sorts there too. 28 bytes a particle, 44 with near ones; 4 more while it works. Waits
// once for the device, to see whether any are near, unless the target is orthographic.
// ResourceExhausted where a storage block does not hold the positions: beyond 11 million particles
// where it holds the 128 MiB that GL asks for. Larger lists are bound in parts. Needs a current
// context.
absl::StatusOr<DeviceSprites> ListDeviceSprites(Gpu& gpu, const ParticleBuffers& particles,
                                                const glm::dvec3& origin, const Projection& target,
                                                double near_depth = 0.0);

// ListTiles() of a run of places, entry for entry the CPU's; entries are places of the whole order,
// by whose place `rects` are (uvec2, as in DeviceSprites).
// Waits once for the device, for the number of entries. 4 bytes an entry and a tile; 12 an entry
// and 4 a place more while it works. ResourceExhausted where a storage block does not hold 4 bytes
// an entry or 8 a place: shorter runs then fit. Needs a current context.
absl::StatusOr<DeviceTiles> ListDeviceTiles(Gpu& gpu, const gl::Buffer& rects, const PlaceRun& run,
                                            const glm::ivec2& target_size, int tile_size);

// Copy lists made on the CPU. Need a current context.
DeviceSprites UploadSprites(const SpriteList& list);
DeviceTiles UploadTiles(const TileLists& lists);

}  // namespace halflight::sweep
