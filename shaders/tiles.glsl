// Which tiles a rectangle touches, row by row. Included after bindings.h.
#include "workgroup.glsl"

layout(local_size_x = kListGroupSize) in;

layout(std140, binding = kTilesBinding) uniform Tiles { TilesBlock tiles; };
layout(std430, binding = kTileRectsBinding) readonly buffer Rects { uvec2 rects[]; };

uint InvocationIndex() { return WorkgroupIndex() * kListGroupSize + gl_LocalInvocationIndex; }

struct TileRange {
  uvec2 first;
  uvec2 count;
};

// Of a place of the run.
TileRange TilesOf(uint k) {
  uvec2 rect = rects[tiles.run.x + k];
  uvec2 low = rect & 0xFFFFu;
  uvec2 high = rect >> 16u;
  if (low.x >= high.x) return TileRange(uvec2(0u), uvec2(0u));
  uvec2 first = low / tiles.tiles.z;
  return TileRange(first, (high - 1u) / tiles.tiles.z + 1u - first);
}
