#version 450
#extension GL_GOOGLE_include_directive : require
// One particle at one pixel, premultiplied:
//   image = (color alpha, alpha)
//   depth = (depth alpha, 0, 0, alpha)         transmittance = (transmittance alpha, alpha)
// Blending: front to back ONE_MINUS_DST_ALPHA, ONE; back to front ONE, ONE_MINUS_SRC_ALPHA.
#include "bindings.h"
#include "radiance.glsl"
#include "splat.glsl"
#include "sliced_particle.glsl"
#include "shade_sliced_particle.glsl"

layout(constant_id = kDepthOutputConstant) const bool kDepthOutput = false;
layout(constant_id = kTransmittanceOutputConstant) const bool kTransmittanceOutput = false;

layout(binding = kLightBeforeBinding) uniform sampler2D light_before;
layout(binding = kLightAfterBinding) uniform sampler2D light_after;

layout(location = 0) flat in vec4 center;
layout(location = 1) flat in vec4 optics;
layout(location = 2) flat in vec3 albedo;
layout(location = 3) flat in vec3 emission;
layout(location = 4) flat in vec4 light_center;

layout(location = 0) out vec4 image;
layout(location = 1) out vec4 depth;
layout(location = 2) out vec4 transmittance;

vec4 TexelBefore(vec2 at, float layer) { return texture(light_before, at); }
vec4 TexelAfter(vec2 at, float layer) { return texture(light_after, at); }

void main() {
  SlicedParticle p = SlicedParticle(center, optics, albedo, emission, light_center);
  Shade shade;
  if (!ShadeParticle(gl_FragCoord.xy, p, 0.0, shade)) discard;
  image = vec4(shade.color * shade.alpha, shade.alpha);
  if (kDepthOutput) depth = vec4(shade.depth * shade.alpha, 0.0, 0.0, shade.alpha);
  if (kTransmittanceOutput) transmittance = vec4(shade.transmittance * shade.alpha, shade.alpha);
}
