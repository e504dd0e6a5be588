#version 450
#extension GL_GOOGLE_include_directive : require
// One quad a particle over the image; see composite.frag.
#include "bindings.h"
#include "splat.glsl"

layout(constant_id = kHasColorsConstant) const bool kHasColors = false;
layout(constant_id = kHasEmissionsConstant) const bool kHasEmissions = false;
layout(constant_id = kShadowedConstant) const bool kShadowed = false;

layout(std140, binding = kCompositeBinding) uniform Composite { CompositeBlock composite; };
layout(std430, binding = kOrderBinding) readonly buffer Order { OrderedParticle order[]; };
layout(std430, binding = kColorsBinding) readonly buffer Colors { float colors[]; };
layout(std430, binding = kEmissionsBinding) readonly buffer Emissions { float emissions[]; };
layout(std430, binding = kSplatsBinding) readonly buffer Splats { Splat splats[]; };
layout(std430, binding = kLightSplatsBinding) readonly buffer LightSplats { Splat light_splats[]; };

layout(location = 0) flat out vec4 center;
layout(location = 1) flat out vec4 optics;        // optical depth, general, place, depth for the light
layout(location = 2) flat out vec4 albedo;
layout(location = 3) flat out vec4 emission;
layout(location = 4) flat out vec4 light_center;

void main() {
  int place = gl_VertexID >> 2;
  Splat splat = splats[place];
  uint i = order[place].index;
  center = splat.center;
  optics = vec4(splat.optics.xy, order[place].place, 0.0);
  albedo = composite.albedo;
  if (kHasColors) {
    albedo.rgb *= vec3(colors[3u * i], colors[3u * i + 1u], colors[3u * i + 2u]);
  }
  emission = composite.emission;
  if (kHasEmissions) {
    emission.rgb = vec3(emissions[3u * i], emissions[3u * i + 1u], emissions[3u * i + 2u]);
  }
  light_center = vec4(0.0);
  if (kShadowed) {
    light_center = light_splats[place].center;
    optics.w = light_splats[place].optics.x;
  }
  gl_Position = RectCorner(splat.rect, gl_VertexID & 3);
}
