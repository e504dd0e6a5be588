// A particle of the light sweep as the eye sees it: what its shading reads. Included after
// bindings.h and splat.glsl.
#include "workgroup.glsl"

layout(constant_id = kHasRadiiConstant) const bool kHasRadii = false;

layout(local_size_x = kShadeGroupSize) in;

layout(std140, binding = kShadeBinding) uniform Shade { ShadeBlock shade; };
layout(std140, binding = kParticlesBinding) uniform Particles { ParticlesBlock particles; };
layout(std430, binding = kEyeParticlesBinding) readonly buffer EyeParticles { uint indices[]; };
layout(std430, binding = kPositionsBinding) readonly buffer Positions { float positions[]; };
layout(std430, binding = kRadiiBinding) readonly buffer Radii { float radii[]; };
layout(std430, binding = kEyeSpritesBinding) readonly buffer EyeSprites { vec4 sprites[]; };
layout(std430, binding = kEyeNearBinding) readonly buffer EyeNear { vec4 near_centers[]; };

struct SeenParticle {
  uint index;        // in its set
  vec4 sprite;       // x, y, scale, optical depth
  bool near;         // has no scaled coordinates
  vec3 near_center;  // radii, view axes
  float radius;
  vec3 center;  // view axes, from the eye
  // Offsets from the centre in radii (view axes) for which scaled coordinates (1, 0) and (0, 1)
  // stand, to first order: offsets are perpendicular to the ray through the centre.
  vec3 x;
  vec3 y;
};

uint PlaceOfInvocation() { return WorkgroupIndex() * kShadeGroupSize + gl_LocalInvocationID.x; }

SeenParticle SeeParticle(uint place) {
  SeenParticle seen;
  seen.index = indices[place];
  seen.sprite = sprites[place];
  seen.near = kNearEye && seen.sprite.z == 0.0;
  seen.near_center = seen.near ? near_centers[place].xyz : vec3(0.0);
  seen.radius = kHasRadii ? radii[seen.index] : particles.uniforms.x;
  seen.x = vec3(1.0, 0.0, 0.0);
  seen.y = vec3(0.0, 1.0, 0.0);
  if (kOrthographic) {
    uint at = 3u * seen.index;
    seen.center = ViewFromOffset(vec3(positions[at], positions[at + 1u], positions[at + 2u]));
    return seen;
  }
  vec3 ray = vec3(seen.sprite.xy, -1.0);
  seen.center = seen.radius * (seen.near ? seen.near_center : seen.sprite.z * ray);
  vec3 across = ray / dot(ray, ray);
  seen.x -= ray.x * across;
  seen.y -= ray.y * across;
  return seen;
}
