#version 450
#extension GL_GOOGLE_include_directive : require
// Adds a slice's particles to the light buffer: buffer += tau_i w(b / r_i), in 32-bit float.
// Blending: ONE, ONE. The light never lies within a particle, so the general encounter is not met.
#include "bindings.h"
#include "splat.glsl"

layout(location = 0) flat in vec4 center;
layout(location = 1) flat in float optical_depth;
layout(location = 0) out vec4 deposit;

void main() {
  Encounter e = MeetParticle(gl_FragCoord.xy, center, false);
  if (e.rho_squared >= 1.0) discard;
  deposit = vec4(optical_depth * ProfileWeight(e.rho_squared));
}
