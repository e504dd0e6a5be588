#version 450
#extension GL_GOOGLE_include_directive : require
// The eye pass of the light sweep, a workgroup a tile and an invocation a pixel: particles over one
// another front to back ("over" of Porter and Duff 1984), in registers:
//   image = sum of seen * (rgb + albedo * sum over lights of color * factor * exp(-exponent(x, y)))
//   depth = sum of seen * depth(x, y)      transmittance = sum of seen * exp(-exponent(x, y))
//   coverage = sum of seen                 seen = alpha * (1 - coverage of those in front)
// A tile's list is read in chunks that all invocations load together. Runs of particles are summed
// on their own, so that a million thin layers add up. What the target holds lies in front, so that
// a list may be walked in several dispatches. A tile is left once all of it is covered.
#include "bindings.h"
#include "splat.glsl"
#include "tile_records.glsl"

layout(constant_id = kTileChunkConstant) const uint kChunk = 1;  // particles loaded at once
layout(constant_id = kTileLightsConstant) const uint kTileLights = 0;
layout(constant_id = kTileShowsConstant) const uint kShows = kShowsColor;

layout(local_size_x_id = kTileColumnsConstant, local_size_y_id = kTileRowsConstant) in;

layout(std140, binding = kTileCompositeBinding) uniform Composite { TileCompositeBlock composite; };
layout(std430, binding = kTileHeadsBinding) readonly buffer Heads { vec4 all_heads[]; };
layout(std430, binding = kTileLightsBinding) readonly buffer Records { float all_records[]; };
layout(std430, binding = kTileBeginBinding) readonly buffer Begin { uint list_begin[]; };
layout(std430, binding = kTileEntriesBinding) readonly buffer Entries { uint entries[]; };
layout(rgba32f, binding = kTileTargetBinding) uniform image2D target;

// Particles that are summed before they go behind the others: enough that those sums stay few.
const uint kRun = 32;
// Less transmittance than this is opaque, as in renderer/sweep/compositor.h.
const float kLeastTransmittance = 1e-6;

const uint kSpriteFloats = kTileLights * kRecordFloats;
shared vec4 heads[kChunk * kHeadVectors];
shared float records[kChunk * kSpriteFloats + 1];
// Whether some pixel is still open, said in turns, so that one is read while the other is written.
shared bool open[2];

uint ShadedPlace(uint entry) { return entries[entry] - composite.walk.z; }

void LoadChunk(uint at, uint count) {
  const uint invocations = gl_WorkGroupSize.x * gl_WorkGroupSize.y;
  for (uint k = gl_LocalInvocationIndex; k < count * kHeadVectors; k += invocations) {
    heads[k] = all_heads[ShadedPlace(at + k / kHeadVectors) * kHeadVectors + k % kHeadVectors];
  }
  if (kTileLights == 0u) return;
  for (uint k = gl_LocalInvocationIndex; k < count * kSpriteFloats; k += invocations) {
    uint slot = ShadedPlace(at + k / kSpriteFloats) * composite.slots.y + composite.slots.x;
    records[k] = all_records[slot * kRecordFloats + k % kSpriteFloats];
  }
}

// A row of a polynomial, the powers of y up to a degree. Unrolled by hand: what a loop here costs
// counts against the iterations after which llvmpipe ends a shader's loops.
float EvaluateRow(uint row, int degree, float y) {
  float value = 0.0;
  if (degree >= 6) value = records[row + 6u];
  if (degree >= 5) value = value * y + records[row + 5u];
  if (degree >= 4) value = value * y + records[row + 4u];
  if (degree >= 3) value = value * y + records[row + 3u];
  if (degree >= 2) value = value * y + records[row + 2u];
  if (degree >= 1) value = value * y + records[row + 1u];
  return value * y + records[row];
}

float Evaluate(uint polynomial, vec2 at) {
  float value = 0.0;
#define ADD_ROW(a)                                                             \
  if (kDegree >= a) {                                                          \
    uint row = polynomial + uint(a * (kDegree + 1) - a * (a - 1) / 2);         \
    value = value * at.x + EvaluateRow(row, kDegree - a, at.y);                \
  }
  ADD_ROW(6)
  ADD_ROW(5)
  ADD_ROW(4)
  ADD_ROW(3)
  ADD_ROW(2)
  ADD_ROW(1)
  ADD_ROW(0)
#undef ADD_ROW
  return value;
}

// Of a light, what reaches the particle's point on the ray, relative to its colour but for `color`.
vec3 LightOf(uint record, vec4 color, vec2 at) {
  uint exponents = record + kExponentsAt;
  vec3 exponent = vec3(Evaluate(exponents, at));
  if (kColoredDensity) {
    exponent.y = Evaluate(exponents + uint(kTerms), at);
    exponent.z = Evaluate(exponents + uint(2 * kTerms), at);
  }
  return color.rgb * records[record] * exp(-max(exponent, vec3(color.w)));
}

// One particle of the chunk at one pixel, premultiplied. `ray` is the pixel's, `inverse_length` its
// length to the power of -2.
vec4 LayerOf(uint s, vec2 pixel, vec2 ray, float inverse_length) {
  vec4 sprite = heads[s * kHeadVectors];
  vec4 unshadowed = heads[s * kHeadVectors + 1u];
  bool near = kNearEye && unshadowed.w != 0.0;
  vec2 at = vec2(0.0);
  vec3 offset = vec3(0.0);
  float rho_squared;
  if (near) {
    Encounter e = MeetParticle(pixel, vec4(sprite.xyz, 1.0), true);
    offset = e.offset;
    rho_squared = e.in_front ? e.rho_squared : 1.0;
  } else {
    at = (ray - sprite.xy) * sprite.z;
    rho_squared = dot(at, at);
    if (!kOrthographic) {
      float turn = sprite.x * at.y - sprite.y * at.x;
      rho_squared = (rho_squared + turn * turn) * inverse_length;
    }
  }
  if (!(rho_squared < 1.0)) return vec4(0.0);
  float alpha = OpacityFromOpticalDepth(sprite.w * ProfileWeight(rho_squared));

  if (kShows == kShowsDepth) {
    vec4 depth = heads[s * kHeadVectors + kHeadVectors - 1u];
    float z = near ? depth.x - depth.y * offset.z : depth.x + depth.y * at.y + depth.z * at.x;
    return vec4(z * alpha, 0.0, 0.0, alpha);
  }
  vec3 light = vec3(0.0);
  for (uint l = 0u; l < kTileLights; ++l) {
    uint record = (s * kTileLights + l) * kRecordFloats;
    if (near) {
      uint axes = record + kNearAt;
      at = vec2(dot(vec3(records[axes], records[axes + 1u], records[axes + 2u]), offset),
                dot(vec3(records[axes + 3u], records[axes + 4u], records[axes + 5u]), offset));
    }
    light += LightOf(record, composite.colors[composite.slots.x + l], at);
  }
  if (kShows == kShowsColor) light = unshadowed.rgb + heads[s * kHeadVectors + 2u].rgb * light;
  return vec4(light * alpha, alpha);
}

void main() {
  uvec2 tile_at = gl_WorkGroupID.xy + composite.tiles.xy;
  uint tile = tile_at.y * composite.tiles.z + tile_at.x;
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec2 sample_at = vec2(tile_at * gl_WorkGroupSize.xy + gl_LocalInvocationID.xy) + 0.5;
  vec2 ray = PlaneFromPixel(sample_at);
  float inverse_length = 1.0 / (dot(ray, ray) + 1.0);
  bool inside = all(lessThan(pixel, imageSize(target)));
  vec4 total = inside ? imageLoad(target, pixel) : vec4(0.0, 0.0, 0.0, 1.0);
  vec4 run = vec4(0.0);
  uint in_run = 0u;

  uint first = list_begin[tile] + composite.walk.x;
  uint end = min(list_begin[tile + 1u], first + composite.walk.y);
  uint turn = 0u;
  if (gl_LocalInvocationIndex == 0u) open[0] = open[1] = false;
  barrier();
  if (1.0 - total.a >= kLeastTransmittance) open[0] = true;
  for (uint chunk = first; chunk < end; chunk += kChunk) {
    barrier();  // all have said whether they are open, and are done with the chunk before
    if (!open[turn]) break;
    uint count = min(kChunk, end - chunk);
    LoadChunk(chunk, count);
    barrier();  // all have read
    if (gl_LocalInvocationIndex == 0u) open[turn] = false;
    turn ^= 1u;
    for (uint s = 0u; s < count; ++s) {
      run += (1.0 - run.a) * LayerOf(s, sample_at, ray, inverse_length);
    }
    in_run += count;
    if (in_run >= kRun) {
      total += (1.0 - total.a) * run;
      run = vec4(0.0);
      in_run = 0u;
    }
    if (1.0 - total.a >= kLeastTransmittance) open[turn] = true;
  }
  total += (1.0 - total.a) * run;
  if (inside) imageStore(target, pixel, total);
}
