#version 450
#extension GL_GOOGLE_include_directive : require
// The light sweep's shading, but for the lights that vary or cast shadows: the head of every
// particle, by place, after
//   rgb = albedo (ambient + sum of constant light) + emission
//   depth(x, y) = depth of the centre - r dot((0, 0, 1), offset in radii at (x, y))
#include "bindings.h"
#include "splat.glsl"
#include "tile_records.glsl"
#include "seen_particle.glsl"

layout(constant_id = kHasColorsConstant) const bool kHasColors = false;
layout(constant_id = kHasEmissionsConstant) const bool kHasEmissions = false;

layout(std430, binding = kColorsBinding) readonly buffer Colors { float colors[]; };
layout(std430, binding = kEmissionsBinding) readonly buffer Emissions { float emissions[]; };
layout(std430, binding = kShadedBinding) writeonly buffer Heads { vec4 heads[]; };

void main() {
  uint place = PlaceOfInvocation();
  if (place >= shade.range.x) return;
  SeenParticle seen = SeeParticle(place);
  uint at = 3u * seen.index;
  vec3 albedo = shade.albedo.rgb;
  if (kHasColors) albedo *= vec3(colors[at], colors[at + 1u], colors[at + 2u]);
  vec3 emission = shade.emission.rgb;
  if (kHasEmissions) emission = vec3(emissions[at], emissions[at + 1u], emissions[at + 2u]);

  uint head = place * kHeadVectors;
  heads[head] = vec4(seen.near ? seen.near_center : seen.sprite.xyz, seen.sprite.w);
  heads[head + 1u] =
      vec4(albedo * shade.constant_light.rgb + emission, seen.near ? 1.0 : 0.0);
  heads[head + 2u] = vec4(albedo, 0.0);
  if (kDepthOutput) {
    vec2 slope = seen.near ? vec2(seen.radius, 0.0) : -seen.radius * vec2(seen.y.z, seen.x.z);
    heads[head + 3u] = vec4(-seen.center.z, slope, 0.0);
  }
}
