#version 450
#extension GL_GOOGLE_include_directive : require
// Counts the tiles that the particle at each place of a run touches.
#include "bindings.h"
#include "tiles.glsl"

layout(std430, binding = kEntryBeginsBinding) writeonly buffer Counts { uint counts[]; };

void main() {
  uint k = InvocationIndex();
  if (k >= tiles.run.y) return;
  uvec2 count = TilesOf(k).count;
  counts[k] = count.x * count.y;
}
