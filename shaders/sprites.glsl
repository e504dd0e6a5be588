// Particles as a target sees them, in the float64 arithmetic of renderer/sweep/sprites.cpp, step by
// step, so that both come to the same. Included after bindings.h.
#include "workgroup.glsl"

layout(constant_id = kOrthographicConstant) const bool kOrthographic = false;
layout(constant_id = kHasRadiiConstant) const bool kHasRadii = false;

layout(local_size_x = kListGroupSize) in;

layout(std140, binding = kParticlesBinding) uniform Particles { ParticlesBlock particles; };
layout(std140, binding = kSpriteTargetBinding) uniform Target { SpriteTargetBlock target; };
layout(std430, binding = kPositionsBinding) readonly buffer Positions { float positions[]; };
layout(std430, binding = kRadiiBinding) readonly buffer Radii { float radii[]; };

uint InvocationIndex() { return WorkgroupIndex() * kListGroupSize + gl_LocalInvocationIndex; }

double RadiusOf(uint i) { return double(kHasRadii ? radii[i] : particles.uniforms.x); }

// The centre in view axes, from the eye.
dvec3 ViewOf(uint i) {
  precise dvec3 offset =
      dvec3(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]) +
      target.origin_from_eye.xyz;
  precise dvec3 view = target.view_from_world[0].xyz * offset.x +
                       target.view_from_world[1].xyz * offset.y +
                       target.view_from_world[2].xyz * offset.z;
  return view;
}

// Particles smaller than a light buffer can show are enlarged.
double DrawnRadius(uint i, double w) {
  precise double least = target.size.z * (kOrthographic ? 1.0 : max(w, 0.0));
  return max(RadiusOf(i), least);
}
