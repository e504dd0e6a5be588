// The eye pass of the light sweep on the device: tiles of the image, a workgroup each, an
// invocation a pixel (shaders/composite_tiles.comp). Lists and shades nothing.
//
// What limits it: a tile is walked by its workgroup alone, so that a frame ends with its longest
// list that is not covered early; small tiles shorten lists and fill a GPU, large ones load each
// particle less often: its head and records (ShadedLayout) once an entry. Every pixel of a tile
// meets every particle of its list, but evaluates the light only of those that it lies in.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "absl/status/status.h"
#include "renderer/frame_engine.h"
#include "renderer/gpu.h"
#include "renderer/passes/project.h"
#include "renderer/sweep/device/lists.h"
#include "renderer/sweep/device/shading.h"

namespace halflight::sweep {

// How a device walks tiles.
struct TileWalk {
  int tile_size = 8;  // pixels along each side
  // Iterations of loops by one invocation in one dispatch, at most: longer lists take several.
  uint32_t most_iterations = 1U << 22U;
};

// llvmpipe ends a shader's loops after 65,535 iterations; 8 x 8 pixels did best there. Other
// devices get 16 x 16, so that a particle is loaded less often; no figures of any are known yet.
TileWalk TileWalkFor(const DeviceInfo& device);

// Textures of the size of a part of the image, premultiplied R G B A.
struct TileTargets {
  glm::ivec2 first_tile{0};  // with which the part begins; it ends with one, or with the image
  gl::Texture beauty;
  gl::Texture depth;                       // depth * alpha, 0, 0, alpha; empty unless wanted
  std::vector<gl::Texture> transmittance;  // by slot: R G B * alpha, alpha; empty unless wanted
};

// With nothing in them. `transmittance` has the slots that an output shows.
TileTargets MakeTileTargets(const glm::ivec2& size, const ShadedLayout& layout,
                            const std::vector<int>& transmittance);

// Composites the particles of `shaded` behind what the targets hold. `tiles` are the lists of the
// same run, with tiles as large as the walk's. Sums, bounds and formulas are those of
// CompositeTiles. What part of the image the targets are makes no difference to a pixel. Cancelled
// when `stop` says so. Needs a current context.
absl::Status CompositePlaces(Gpu& gpu, const Scene& scene, const TargetProjection& eye,
                             const ShadedLayout& layout, const ShadedPlaces& shaded,
                             const DeviceTiles& tiles, const TileWalk& walk,
                             const TileTargets& targets, const std::stop_token& stop);

}  // namespace halflight::sweep
