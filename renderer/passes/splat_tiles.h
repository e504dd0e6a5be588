// Which splats touch which tile of a target, in the traversal's order.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"
#include "renderer/gpu.h"
#include "renderer/sweep/device/lists.h"
#include "renderer/sweep/tiles.h"

namespace halflight {

// Rectangles of splats within a band of their target, by place in the order. A device that is a CPU
// has them in main memory, where they are listed faster than by its compute shaders.
struct SplatRects {
  gl::Buffer on_device;  // uvec2, as in sweep::DeviceSprites
  std::vector<sweep::Rect> on_cpu;
  glm::ivec2 size{0};  // of the band
};

// `projection` is the shader::ProjectionBlock of the band. 8 bytes a particle. Needs a current
// context.
absl::StatusOr<SplatRects> FindSplatRects(Gpu& gpu, const DeviceInfo& device,
                                          const ParticleBuffers& particles,
                                          const gl::Buffer& splats, const gl::Buffer& projection,
                                          const glm::ivec2& size);

// Lists of the places from `run.first` on, as many of the run as one list may hold.
struct SplatTiles {
  sweep::DeviceTiles lists;
  sweep::PlaceRun run;
};
absl::StatusOr<SplatTiles> ListSplatTiles(Gpu& gpu, const SplatRects& rects,
                                          const sweep::PlaceRun& run, int tile_size);

}  // namespace halflight
