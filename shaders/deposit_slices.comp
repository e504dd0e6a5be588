#version 450
#extension GL_GOOGLE_include_directive : require
// Walks particles of consecutive slices through the light buffer, a workgroup a tile and an
// invocation a texel, which keeps the texel in registers: buffer += what deposit.glsl says, in the
// traversal's order, so that the sums are those of blending, bit for bit where it adds float32 in
// order. Where a slice begins, the layer that it sees becomes what the buffer then holds; at the
// end, what the last slice leaves. Reads one light buffer and writes another.
#include "bindings.h"
#include "splat.glsl"
#include "deposit.glsl"
#include "workgroup.glsl"

layout(local_size_x_id = kLightTileSizeConstant, local_size_y_id = kLightTileSizeConstant) in;

layout(std140, binding = kSliceWalkBinding) uniform SliceWalk { SliceWalkBlock walk; };
layout(std430, binding = kLightSplatsBinding) readonly buffer Splats { Splat splats[]; };
layout(std430, binding = kSliceTileBeginBinding) readonly buffer Begins { uint list_begin[]; };
layout(std430, binding = kSliceTileEntriesBinding) readonly buffer Entries { uint entries[]; };
layout(std430, binding = kSliceBeginsBinding) readonly buffer SliceBegins { uint slice_begin[]; };

layout(binding = kSourceBinding) uniform sampler2D source;
layout(binding = kLightTargetBinding) uniform writeonly image2D target;
layout(binding = kLayersTargetBinding) uniform writeonly image2DArray layers;

shared uint places[kSliceChunk];
shared vec4 centers[kSliceChunk];
shared float optical_depths[kSliceChunk];

// The first entry of [first, end) whose place is `place` or a later one.
uint FirstEntry(uint first, uint end, uint place) {
  while (first < end) {
    uint middle = first + (end - first) / 2u;
    if (entries[middle] < place) {
      first = middle + 1u;
    } else {
      end = middle;
    }
  }
  return first;
}

int LayerBefore(uint slice) { return int((slice - walk.window.z) * walk.slices.z); }

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(texel, imageSize(target)));
  vec2 at = vec2(texel) + 0.5;
  vec4 sum = inside ? texelFetch(source, texel, 0) : vec4(0.0);
  uint slice = walk.slices.x;
  uint begins_at = slice < walk.slices.y ? slice_begin[slice] : 0xFFFFFFFFu;

  uint tile = WorkgroupIndex();
  uint end = FirstEntry(list_begin[tile], list_begin[tile + 1u], walk.window.y);
  uint chunk = FirstEntry(list_begin[tile], end, walk.window.x);
  for (; chunk < end; chunk += kSliceChunk) {
    uint count = min(end - chunk, kSliceChunk);
    barrier();
    if (gl_LocalInvocationIndex < count) {
      uint place = entries[chunk + gl_LocalInvocationIndex];
      places[gl_LocalInvocationIndex] = place;
      centers[gl_LocalInvocationIndex] = splats[place].center;
      optical_depths[gl_LocalInvocationIndex] = splats[place].optics.x;
    }
    barrier();
    for (uint k = 0u; k < count;) {
      for (; k < count && places[k] < begins_at; ++k) {
        sum += DepositAt(at, centers[k], optical_depths[k]);
      }
      if (k < count) {
        if (inside) imageStore(layers, ivec3(texel, LayerBefore(slice)), sum);
        ++slice;
        begins_at = slice < walk.slices.y ? slice_begin[slice] : 0xFFFFFFFFu;
      }
    }
  }
  if (!inside) return;
  for (; slice < walk.slices.y; ++slice) {
    imageStore(layers, ivec3(texel, LayerBefore(slice)), sum);
  }
  imageStore(layers, ivec3(texel, LayerBefore(slice - 1u) + 1), sum);
  imageStore(target, texel, sum);
}
