#version 450
#extension GL_GOOGLE_include_directive : require
// How many squares of a grid, texels of the light buffer or tiles of a target, the rectangles of the
// particles before each one touch, counted from its group of kScanGroupSize places on; and how many
// those of each group touch together.
#include "bindings.h"
#include "scan.glsl"

layout(std140, binding = kPlaceRunBinding) uniform PlaceRun { PlaceRunBlock places; };
layout(std430, binding = kLightRectsBinding) readonly buffer Rects { uvec2 rects[]; };
layout(std430, binding = kPatchOffsetsBinding) writeonly buffer Offsets { uint offsets[]; };
layout(std430, binding = kGroupOffsetsBinding) writeonly buffer Groups { uint group_squares[]; };

void main() {
  uint place = WorkgroupIndex() * kScanGroupSize + gl_LocalInvocationIndex;
  uint squares = 0u;
  if (place < places.run.y) {
    uvec2 low = rects[place] & 0xFFFFu;
    uvec2 high = rects[place] >> 16u;
    if (low.x < high.x) {
      uvec2 extent = (high - 1u) / places.run.z + 1u - low / places.run.z;
      // More than a run may have shows as more; how much more does not matter.
      squares = min(extent.x * extent.y, kMaxPatchTexels + 1u);
    }
  }
  uint before = SumBeforeThis(squares);
  if (place >= places.run.y) return;
  offsets[place] = before;
  if (gl_LocalInvocationIndex == kScanGroupSize - 1u || place == places.run.y - 1u) {
    group_squares[WorkgroupIndex()] = AddUpToLargest(before, squares);
  }
}
