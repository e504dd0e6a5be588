#version 450
#extension GL_GOOGLE_include_directive : require
// Colour of one particle at one pixel, after Green 2008, "Volumetric Particle Shadows", with the
// image model's profile and optical depth:
//   alpha = 1 - exp(-tau_i w(b / r_i))
//   image = (albedo (ambient + sum of light * phase * exp(-density * D(x))) + emission) * alpha, alpha
//   depth = (z(x) alpha, 0, 0, alpha)         transmittance = (exp(-density * D(x)) alpha, alpha)
// where x is the ray's point closest to the particle and D the light buffer's optical depth there:
// as the earlier slices left it, or interpolated to the particle's place within its slice with its
// own contribution left out.
// Blending: front to back ONE_MINUS_DST_ALPHA, ONE; back to front ONE, ONE_MINUS_SRC_ALPHA.
#include "bindings.h"
#include "radiance.glsl"
#include "splat.glsl"

layout(constant_id = kShadowedConstant) const bool kShadowed = false;
layout(constant_id = kPointShadowLightConstant) const bool kPointShadowLight = false;
layout(constant_id = kInterpolateConstant) const bool kInterpolate = false;
layout(constant_id = kColoredLightBufferConstant) const bool kColoredLightBuffer = false;
layout(constant_id = kColoredDensityConstant) const bool kColoredDensity = false;
layout(constant_id = kVaryingLightsConstant) const uint kVaryingLights = 0;
// Whether the shadow casting light is the first of those that vary.
layout(constant_id = kShadowLightVariesConstant) const bool kShadowLightVaries = false;
layout(constant_id = kDepthOutputConstant) const bool kDepthOutput = false;
layout(constant_id = kTransmittanceOutputConstant) const bool kTransmittanceOutput = false;

layout(std140, binding = kCompositeBinding) uniform Composite { CompositeBlock composite; };
layout(binding = kLightBeforeBinding) uniform sampler2D light_before;
layout(binding = kLightAfterBinding) uniform sampler2D light_after;

layout(location = 0) flat in vec4 center;
layout(location = 1) flat in vec4 optics;
layout(location = 2) flat in vec4 albedo;
layout(location = 3) flat in vec4 emission;
layout(location = 4) flat in vec4 light_center;

layout(location = 0) out vec4 image;
layout(location = 1) out vec4 depth;
layout(location = 2) out vec4 transmittance;

vec3 LightBuffer(sampler2D buffer_texture, vec2 at) {
  vec4 texel = texture(buffer_texture, at);
  return kColoredLightBuffer ? texel.rgb : texel.rrr;
}

// Optical depth between the light and the point at `offset` (view axes) from the centre.
vec3 OpticalDepthOfLight(vec3 offset) {
  vec3 light_offset = mat3(composite.light_view_from_view) * offset;
  float radius_squared = light_center.w * light_center.w;
  vec2 plane;
  float rho_squared;
  if (kPointShadowLight) {
    vec3 from_light = light_center.z * vec3(light_center.xy, -1.0);
    vec3 to_point = from_light + light_offset;
    vec3 moment = cross(from_light, light_offset);
    plane = to_point.xy / -to_point.z;
    rho_squared = dot(moment, moment) / (dot(to_point, to_point) * radius_squared);
  } else {
    plane = light_center.xy + light_offset.xy;
    rho_squared = dot(light_offset.xy, light_offset.xy) / radius_squared;
  }
  vec2 at = plane * composite.light_texture_from_plane.xy + composite.light_texture_from_plane.zw;
  vec3 before = LightBuffer(light_before, at);
  if (!kInterpolate) return before;
  vec3 others = LightBuffer(light_after, at) - before - optics.w * ProfileWeight(rho_squared);
  return before + optics.z * max(others, 0.0);
}

void main() {
  bool general = kNearEye && optics.y != 0.0;
  Encounter e = MeetParticle(gl_FragCoord.xy, center, general);
  if (e.rho_squared >= 1.0 || !e.in_front) discard;
  float alpha = OpacityFromOpticalDepth(optics.x * ProfileWeight(e.rho_squared));

  vec3 shadow = vec3(1.0);
  if (kShadowed) {
    vec3 attenuation = composite.density.rgb * OpticalDepthOfLight(e.offset);
    shadow = kColoredDensity ? exp(-attenuation) : vec3(exp(-attenuation.r));
  }
  vec3 light = composite.constant_light.rgb + composite.constant_shadowed.rgb * shadow;

  vec3 center_in_view = kOrthographic ? vec3(center.xy, -center.z)
                        : general     ? center.xyz
                                      : center.z * vec3(center.xy, -1.0);
  vec3 at = center_in_view + e.offset;
  for (uint l = 0u; l < kVaryingLights; ++l) {
    vec3 radiance = composite.lights[l].color.rgb *
                    RadianceFactor(composite.lights[l], albedo.w, at, e.ray);
    light += kShadowLightVaries && l == 0u ? radiance * shadow : radiance;
  }
  image = vec4((albedo.rgb * light + emission.rgb) * alpha, alpha);
  if (kDepthOutput) depth = vec4(-at.z * alpha, 0.0, 0.0, alpha);
  if (kTransmittanceOutput) transmittance = vec4(shadow * alpha, alpha);
}
