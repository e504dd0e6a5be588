#version 450
#extension GL_GOOGLE_include_directive : require
// Adds a slice's particles to the light buffer, in 32-bit float. Blending: ONE, ONE.
#include "bindings.h"
#include "splat.glsl"
#include "deposit.glsl"

layout(location = 0) flat in vec4 center;
layout(location = 1) flat in float optical_depth;
layout(location = 0) out vec4 deposit;

void main() { deposit = DepositAt(gl_FragCoord.xy, center, optical_depth); }
