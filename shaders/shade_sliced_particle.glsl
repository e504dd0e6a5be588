// Colour of one particle at one pixel, after Green 2008, "Volumetric Particle Shadows", with the
// image model's profile and optical depth:
//   alpha = 1 - exp(-tau_i w(b / r_i))
//   color = albedo (ambient + sum of light * phase * exp(-density * D(x))) + emission
//   depth = z(x)         transmittance = exp(-density * D(x))
// where x is the ray's point closest to the particle and D the light buffer's optical depth there:
// as the earlier slices left it, or interpolated to the particle's place within its slice with its
// own contribution left out. Included after radiance.glsl, splat.glsl and sliced_particle.glsl.

layout(constant_id = kPointShadowLightConstant) const bool kPointShadowLight = false;
layout(constant_id = kInterpolateConstant) const bool kInterpolate = false;
layout(constant_id = kColoredLightBufferConstant) const bool kColoredLightBuffer = false;
layout(constant_id = kColoredDensityConstant) const bool kColoredDensity = false;
layout(constant_id = kVaryingLightsConstant) const uint kVaryingLights = 0;
// Whether the shadow casting light is the first of those that vary.
layout(constant_id = kShadowLightVariesConstant) const bool kShadowLightVaries = false;

// Texels of the light buffer at texture coordinates, as who includes this keeps them: without the
// slice that sees `layer`, and with it.
vec4 TexelBefore(vec2 at, float layer);
vec4 TexelAfter(vec2 at, float layer);

vec3 OpticalDepths(vec4 texel) { return kColoredLightBuffer ? texel.rgb : texel.rrr; }

// Optical depth between the light and the point at `offset` (view axes) from the centre.
vec3 OpticalDepthOfLight(SlicedParticle p, vec3 offset, float layer) {
  vec3 light_offset = mat3(composite.light_view_from_view) * offset;
  float radius_squared = p.light_center.w * p.light_center.w;
  vec2 plane;
  float rho_squared;
  if (kPointShadowLight) {
    vec3 from_light = p.light_center.z * vec3(p.light_center.xy, -1.0);
    vec3 to_point = from_light + light_offset;
    vec3 moment = cross(from_light, light_offset);
    plane = to_point.xy / -to_point.z;
    rho_squared = dot(moment, moment) / (dot(to_point, to_point) * radius_squared);
  } else {
    plane = p.light_center.xy + light_offset.xy;
    rho_squared = dot(light_offset.xy, light_offset.xy) / radius_squared;
  }
  vec2 at = plane * composite.light_texture_from_plane.xy + composite.light_texture_from_plane.zw;
  vec3 before = OpticalDepths(TexelBefore(at, layer));
  if (!kInterpolate) return before;
  vec3 others = OpticalDepths(TexelAfter(at, layer)) - before -
                p.optics.w * ProfileWeight(rho_squared);
  return before + p.optics.z * max(others, 0.0);
}

struct Shade {
  vec3 color;
  float alpha;
  float depth;
  vec3 transmittance;
};

// False where the ray through the band's `pixel` does not meet the particle.
bool ShadeParticle(vec2 pixel, SlicedParticle p, float layer, out Shade shade) {
  bool general = kNearEye && p.optics.y != 0.0;
  Encounter e = MeetParticle(pixel, p.center, general);
  if (!(e.rho_squared < 1.0 && e.in_front)) return false;
  shade.alpha = OpacityFromOpticalDepth(p.optics.x * ProfileWeight(e.rho_squared));

  vec3 shadow = vec3(1.0);
  if (kShadowed) {
    vec3 attenuation = composite.density.rgb * OpticalDepthOfLight(p, e.offset, layer);
    shadow = kColoredDensity ? exp(-attenuation) : vec3(exp(-attenuation.r));
  }
  vec3 light = composite.constant_light.rgb + composite.constant_shadowed.rgb * shadow;

  vec3 center_in_view = kOrthographic ? vec3(p.center.xy, -p.center.z)
                        : general     ? p.center.xyz
                                      : p.center.z * vec3(p.center.xy, -1.0);
  vec3 at = center_in_view + e.offset;
  for (uint l = 0u; l < kVaryingLights; ++l) {
    vec3 radiance = composite.lights[l].color.rgb *
                    RadianceFactor(composite.lights[l], composite.albedo.w, at, e.ray);
    light += kShadowLightVaries && l == 0u ? radiance * shadow : radiance;
  }
  shade.color = p.albedo * light + p.emission;
  shade.depth = -at.z;
  shade.transmittance = shadow;
  return true;
}
