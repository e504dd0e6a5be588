#version 450
#extension GL_GOOGLE_include_directive : require
// Sweeps one run of particles through the light buffer, nearest the light first: one workgroup a
// tile, one invocation a texel, which keeps the texel's optical depth in a register. Where a
// particle covers the texel,
//   its patch, there  = optical depth so far
//   optical depth    += optical depth of the particle at its centre * w(rho)
// A texel meets its particles in order and alone, so that nothing is reduced and nothing is atomic.
#include "bindings.h"
#include "splat.glsl"
#include "light_sprite.glsl"
#include "workgroup.glsl"

layout(local_size_x_id = kLightTileSizeConstant, local_size_y_id = kLightTileSizeConstant) in;

layout(std430, binding = kPatchesBinding) writeonly buffer Patches { float patches[]; };
layout(std430, binding = kLightTileBeginBinding) readonly buffer Begins { uint tile_begin[]; };
layout(std430, binding = kLightTileEntriesBinding) readonly buffer Entries { uint entries[]; };
layout(std430, binding = kLightDepthBinding) buffer Depths { float optical_depths[]; };

struct Entry {
  vec4 sprite;
  TexelRect rect;
  uint patch_offset;
};

shared vec4 chunk_sprites[kSweepChunk];
shared uvec4 chunk_rects[kSweepChunk];  // begin, extent
shared uint chunk_offsets[kSweepChunk];

// An empty rectangle from the list's end on.
Entry LoadEntry(uint e, uint end) {
  if (e >= end) return Entry(vec4(0.0), TexelRect(uvec2(0), uvec2(0)), 0u);
  uint place = entries[e];
  return Entry(sprites[place], RectAt(place), PatchOffset(place));
}

// Meets the particle in slot `i` of the chunk.
void Meet(uint i, uvec2 texel, vec2 plane, float inverse_length, inout float depth) {
  uvec4 rect = chunk_rects[i];
  uvec2 within = texel - rect.xy;
  if (within.x < rect.z && within.y < rect.w) {
    patches[chunk_offsets[i] + within.y * rect.z + within.x] = depth;
    vec4 sprite = chunk_sprites[i];
    depth += sprite.w * SpriteWeight((plane - sprite.xy) * sprite.z, sprite, inverse_length);
  }
}

void main() {
  uvec2 texel = gl_GlobalInvocationID.xy;
  uint size = places.run.z;
  bool in_target = texel.x < size && texel.y < size;
  uint at = texel.y * size + texel.x;
  float depth = in_target ? optical_depths[at] : 0.0;
  vec2 plane = PlaneFromTexel(vec2(texel) + 0.5);
  float inverse_length = InverseRayLength(plane);

  uint tile = WorkgroupIndex();
  uint lane = gl_LocalInvocationIndex;
  uint end = tile_begin[tile + 1];
  uint chunk = tile_begin[tile];
  // The next chunk is on its way while one is walked.
  Entry next = LoadEntry(chunk + lane, end);
  for (; chunk < end; chunk += kSweepChunk) {
    barrier();
    if (lane < kSweepChunk) {
      chunk_sprites[lane] = next.sprite;
      chunk_rects[lane] = uvec4(next.rect.begin, next.rect.extent);
      chunk_offsets[lane] = next.patch_offset;
    }
    barrier();
    if (lane < kSweepChunk) next = LoadEntry(chunk + kSweepChunk + lane, end);
    uint count = min(end - chunk, kSweepChunk);
    // By four: loops end early on llvmpipe, and independent loads overlap.
    for (uint i = 0; i < count; i += 4) {
      Meet(i, texel, plane, inverse_length, depth);
      Meet(i + 1, texel, plane, inverse_length, depth);
      Meet(i + 2, texel, plane, inverse_length, depth);
      Meet(i + 3, texel, plane, inverse_length, depth);
    }
  }
  if (in_target) optical_depths[at] = depth;
}
