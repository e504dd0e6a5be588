#version 450
#extension GL_GOOGLE_include_directive : require
// One quad a particle over the image; see composite.frag.
#include "bindings.h"
#include "splat.glsl"
#include "sliced_particle.glsl"
#include "load_sliced_particle.glsl"

layout(location = 0) flat out vec4 center;
layout(location = 1) flat out vec4 optics;
layout(location = 2) flat out vec3 albedo;
layout(location = 3) flat out vec3 emission;
layout(location = 4) flat out vec4 light_center;

void main() {
  uint place = uint(gl_VertexID) >> 2;
  SlicedParticle p = LoadSlicedParticle(place);
  center = p.center;
  optics = p.optics;
  albedo = p.albedo;
  emission = p.emission;
  light_center = p.light_center;
  gl_Position = RectCorner(splats[place].rect, gl_VertexID & 3);
}
