// Sorted particles and tile lists in buffers of the device, for the passes of the light sweep
// there. Shades nothing.
#pragma once

#include <cstddef>
#include <optional>

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

  // On the device.
  [[nodiscard]] size_t bytes() const;
};

// TileLists.
struct DeviceTiles {
  glm::ivec2 tiles{0};
  int tile_size = 0;  // pixels along each side
  // uint[tiles.x * tiles.y + 1]: tile t (row by row) has entries [begin[t], begin[t + 1]).
  gl::Buffer begin;
  gl::Buffer entries;  // uint: place, ascending within a tile
  size_t entry_count = 0;

  // On the device.
  [[nodiscard]] size_t bytes() const;
};

// Places [first, end) of an order.
struct PlaceRun {
  size_t first = 0;
  size_t end = 0;
};

// ListSprites() of particles on the device, `buffers` those of `particles`. In the same steps of
// float64, so that order, sprites and rectangles are the CPU's, bit for bit where the device rounds
// divisions and roots as IEEE 754 asks and depths are no denormal floats: at any distance from the
// origin. Sorts there too. 28 bytes a particle, 44 where any may be near, as the CPU tells from
// their bounds or else one by one; 4 more while it works. ResourceExhausted where a storage block
// does not hold the positions: beyond 11 million particles where it holds the 128 MiB that GL asks
// for. Larger lists are bound in parts. Needs a current context.
absl::StatusOr<DeviceSprites> ListDeviceSprites(Gpu& gpu, const ParticleBuffers& buffers,
                                                const ParticleView& particles,
                                                const Projection& target, double near_depth = 0.0);

// ListTiles() of a run of places, entry for entry the CPU's; entries are places of the whole order,
// by whose place `rects` are, as in DeviceSprites. `entry_count`: how many there are, as runs.h
// tells for many runs at once; without it waits for the device to tell. 4 bytes an entry and a
// tile; 12 an entry and 4 a place more while it works. ResourceExhausted where a storage block does
// not hold 4 bytes an entry or 8 a place: shorter runs then fit. Needs a current context.
absl::StatusOr<DeviceTiles> ListDeviceTiles(Gpu& gpu, const gl::Buffer& rects, const PlaceRun& run,
                                            const glm::ivec2& target_size, int tile_size,
                                            std::optional<size_t> entry_count = std::nullopt);

// Copy lists made on the CPU. Need a current context.
DeviceSprites UploadSprites(const SpriteList& list);
DeviceTiles UploadTiles(const TileLists& lists);

}  // namespace halflight::sweep
