#version 450
#extension GL_GOOGLE_include_directive : require
// How many texels of the light buffer the rectangles of the particles before each one hold, counted
// from its group of kScanGroupSize places on; and how many those of each group hold together.
#include "bindings.h"
#include "scan.glsl"

layout(std140, binding = kPlaceRunBinding) uniform PlaceRun { PlaceRunBlock places; };
layout(std430, binding = kLightRectsBinding) readonly buffer Rects { uvec2 rects[]; };
layout(std430, binding = kPatchOffsetsBinding) writeonly buffer Offsets { uint patch_offsets[]; };
layout(std430, binding = kGroupOffsetsBinding) writeonly buffer Texels { uint group_texels[]; };

void main() {
  uint place = WorkgroupIndex() * kScanGroupSize + gl_LocalInvocationIndex;
  uint texels = 0;
  if (place < places.run.y) {
    uvec2 extent = (rects[place] >> 16) - (rects[place] & 0xFFFFu);
    // More than a run may have shows as more; how much more does not matter.
    texels = min(extent.x * extent.y, kMaxPatchTexels + 1);
  }
  uint before = SumBeforeThis(texels);
  if (place >= places.run.y) return;
  patch_offsets[place] = before;
  if (gl_LocalInvocationIndex == kScanGroupSize - 1 || place == places.run.y - 1) {
    group_texels[WorkgroupIndex()] = AddUpToLargest(before, texels);
  }
}
