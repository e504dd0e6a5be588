// What a particle adds to a light buffer's texel: tau_i w(b / r_i), with tau_i as the light that
// travels forward meets it; for unscattered light, whose tau_i is the whole one, in a channel of
// its own. The light never lies within a particle, so the general encounter is not met. Included
// after splat.glsl.

layout(constant_id = kColoredLightBufferConstant) const bool kColoredLightBuffer = false;
layout(constant_id = kUnscatteredLightConstant) const bool kUnscatteredLight = false;

// `center` is of the light's splat. Nothing where the texel's ray passes by.
vec4 DepositAt(vec2 texel, vec4 center, float optical_depth) {
  Encounter e = MeetParticle(texel, center, false);
  float met = optical_depth * ProfileWeight(e.rho_squared);
  if (!kUnscatteredLight) return vec4(met);
  float whole = met / projection.target_size.w;
  return kColoredLightBuffer ? vec4(vec3(met), whole) : vec4(met, whole, 0.0, 0.0);
}
