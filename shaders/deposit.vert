#version 450
#extension GL_GOOGLE_include_directive : require
// One quad a particle over the light buffer; see deposit.frag.
#include "bindings.h"
#include "splat.glsl"

layout(std430, binding = kLightSplatsBinding) readonly buffer Splats { Splat splats[]; };

layout(location = 0) flat out vec4 center;
layout(location = 1) flat out float optical_depth;

void main() {
  Splat splat = splats[gl_VertexID >> 2];
  center = splat.center;
  optical_depth = splat.optics.x;
  gl_Position = RectCorner(splat.rect, gl_VertexID & 3);
}
