#version 450
#extension GL_GOOGLE_include_directive : require
// The eye pass of a run of slices, a workgroup a tile and an invocation a pixel: the particles of
// the tile's list, shaded as composite.frag shades them, from the nearest to the eye on, in
// registers ("over" of Porter and Duff 1984):
//   image = sum of seen * color           coverage = sum of seen
//   depth = sum of seen * depth           transmittance = sum of seen * transmittance
//   seen = alpha * (1 - coverage of those in front)
// A list is in the traversal's order. Front to back, what the targets hold lies in front of it;
// back to front it is walked from its end, and lies in front of what they hold. Either way a list
// may be walked in several dispatches, window after window. Consecutive particles are summed on
// their own, so that a million thin layers add up. A tile is left once all of it is covered.
#include "bindings.h"
#include "radiance.glsl"
#include "splat.glsl"
#include "sliced_particle.glsl"
#include "load_sliced_particle.glsl"
#include "shade_sliced_particle.glsl"
#include "workgroup.glsl"

layout(constant_id = kDepthOutputConstant) const bool kDepthOutput = false;
layout(constant_id = kTransmittanceOutputConstant) const bool kTransmittanceOutput = false;
layout(constant_id = kBackToFrontConstant) const bool kBackToFront = false;

layout(local_size_x_id = kTileColumnsConstant, local_size_y_id = kTileRowsConstant) in;

layout(std140, binding = kSliceWalkBinding) uniform SliceWalk { SliceWalkBlock walk; };
layout(std430, binding = kSliceTileBeginBinding) readonly buffer Begins { uint list_begin[]; };
layout(std430, binding = kSliceTileEntriesBinding) readonly buffer Entries { uint entries[]; };
layout(std430, binding = kSliceBeginsBinding) readonly buffer SliceBegins { uint slice_begin[]; };

layout(binding = kLightLayersBinding) uniform sampler2DArray light_layers;
layout(rgba32f, binding = kTileTargetBinding) uniform image2D image_target;
layout(rgba32f, binding = kDepthTargetBinding) uniform image2D depth_target;
layout(rgba32f, binding = kTransmittanceTargetBinding) uniform image2D transmittance_target;

// As in composite_tiles.comp.
const uint kRun = 32;
const float kLeastTransmittance = 1e-6;

shared vec4 centers[kSliceChunk];
shared vec4 optics[kSliceChunk];
shared vec4 albedos[kSliceChunk];  // w: layer
shared vec3 emissions_of[kSliceChunk];
shared vec4 light_centers[kSliceChunk];
// Whether some pixel is still open, said in turns, so that one is read while the other is written.
shared bool open[2];

vec4 TexelBefore(vec2 at, float layer) { return textureLod(light_layers, vec3(at, layer), 0.0); }
vec4 TexelAfter(vec2 at, float layer) { return TexelBefore(at, layer + 1.0); }

// The slice of the run in which a place lies: the last that begins there or before.
uint SliceOf(uint place) {
  uint slice = walk.slices.x;
  for (uint end = walk.slices.y; end - slice > 1u;) {
    uint middle = slice + (end - slice) / 2u;
    if (slice_begin[middle] <= place) {
      slice = middle;
    } else {
      end = middle;
    }
  }
  return slice;
}

// Particle k of those to be loaded, nearest the eye first.
void LoadParticle(uint k, uint place) {
  SlicedParticle p = LoadSlicedParticle(place);
  float layer = 0.0;
  if (kShadowed) layer = float((SliceOf(place) - walk.slices.x) * walk.slices.z);
  centers[k] = p.center;
  optics[k] = p.optics;
  albedos[k] = vec4(p.albedo, layer);
  emissions_of[k] = p.emission;
  light_centers[k] = p.light_center;
}

struct Sum {
  vec4 image;
  float depth;
  vec3 transmittance;
};

// What lies behind goes behind.
void Add(inout Sum sum, Sum behind) {
  float open_part = 1.0 - sum.image.a;
  sum.image += open_part * behind.image;
  if (kDepthOutput) sum.depth += open_part * behind.depth;
  if (kTransmittanceOutput) sum.transmittance += open_part * behind.transmittance;
}

Sum LoadTargets(ivec2 pixel) {
  Sum sum = Sum(imageLoad(image_target, pixel), 0.0, vec3(0.0));
  if (kDepthOutput) sum.depth = imageLoad(depth_target, pixel).r;
  if (kTransmittanceOutput) sum.transmittance = imageLoad(transmittance_target, pixel).rgb;
  return sum;
}

void StoreTargets(ivec2 pixel, Sum sum) {
  imageStore(image_target, pixel, sum.image);
  if (kDepthOutput) imageStore(depth_target, pixel, vec4(sum.depth, 0.0, 0.0, sum.image.a));
  if (kTransmittanceOutput) {
    imageStore(transmittance_target, pixel, vec4(sum.transmittance, sum.image.a));
  }
}

void main() {
  uint tile = WorkgroupIndex();
  uint first = list_begin[tile] + walk.window.x;
  uint end = min(list_begin[tile + 1u], first + walk.window.y);
  if (end <= first) return;  // all of the workgroup
  uint length = end - first;

  const Sum kNothing = Sum(vec4(0.0), 0.0, vec3(0.0));
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec2 sample_at = vec2(pixel) + 0.5;
  bool inside = all(lessThan(pixel, imageSize(image_target)));
  Sum held = kNothing;
  if (inside) held = LoadTargets(pixel);
  Sum total = kNothing;
  if (!kBackToFront) total = held;
  if (!inside) total.image.a = 1.0;
  Sum run = kNothing;
  uint in_run = 0u;

  uint turn = 0u;
  if (gl_LocalInvocationIndex == 0u) open[0] = open[1] = false;
  barrier();
  if (1.0 - total.image.a >= kLeastTransmittance) open[0] = true;
  for (uint walked = 0u; walked < length; walked += kSliceChunk) {
    barrier();  // all have said whether they are open, and are done with the chunk before
    if (!open[turn]) break;
    uint count = min(kSliceChunk, length - walked);
    for (uint k = gl_LocalInvocationIndex; k < count;
         k += gl_WorkGroupSize.x * gl_WorkGroupSize.y) {
      LoadParticle(k, entries[kBackToFront ? end - 1u - walked - k : first + walked + k]);
    }
    barrier();  // all have read
    if (gl_LocalInvocationIndex == 0u) open[turn] = false;
    turn ^= 1u;
    for (uint s = 0u; s < count; ++s) {
      SlicedParticle p = SlicedParticle(centers[s], optics[s], albedos[s].rgb, emissions_of[s],
                                        light_centers[s]);
      Shade shade;
      if (!ShadeParticle(sample_at, p, albedos[s].w, shade)) continue;
      Add(run, Sum(vec4(shade.color * shade.alpha, shade.alpha), shade.depth * shade.alpha,
                   shade.transmittance * shade.alpha));
    }
    in_run += count;
    if (in_run >= kRun) {
      Add(total, run);
      run = kNothing;
      in_run = 0u;
    }
    if (1.0 - total.image.a >= kLeastTransmittance) open[turn] = true;
  }
  Add(total, run);
  if (kBackToFront) Add(total, held);
  if (inside) StoreTargets(pixel, total);
}
