#version 450
#extension GL_GOOGLE_include_directive : require
// Adds a slice's particles to the light buffer: buffer += tau_i w(b / r_i), in 32-bit float, with
// tau_i as the light that travels forward meets it; for unscattered light, whose tau_i is the whole
// one, in a channel of its own.
// Blending: ONE, ONE. The light never lies within a particle, so the general encounter is not met.
#include "bindings.h"
#include "splat.glsl"

layout(constant_id = kColoredLightBufferConstant) const bool kColoredLightBuffer = false;
layout(constant_id = kUnscatteredLightConstant) const bool kUnscatteredLight = false;

layout(location = 0) flat in vec4 center;
layout(location = 1) flat in float optical_depth;
layout(location = 0) out vec4 deposit;

void main() {
  Encounter e = MeetParticle(gl_FragCoord.xy, center, false);
  if (e.rho_squared >= 1.0) discard;
  float met = optical_depth * ProfileWeight(e.rho_squared);
  deposit = vec4(met);
  if (kUnscatteredLight) {
    float whole = met / projection.target_size.w;
    deposit = kColoredLightBuffer ? vec4(vec3(met), whole) : vec4(met, whole, 0.0, 0.0);
  }
}
