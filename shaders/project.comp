#version 450
#extension GL_GOOGLE_include_directive : require
// Projects every particle, in sorted order, onto the eye's or a light's target: the rectangle of
// pixels that it can touch, and its centre in a form that keeps precision.
// Bounds of a sphere under perspective: tangents from the eye in the planes of each image axis
// (Mara and McGuire 2013, "2D Polyhedral Bounds of a Clipped, Perspective-Projected 3D Sphere").
#include "bindings.h"
#include "splat.glsl"

layout(constant_id = kHasRadiiConstant) const bool kHasRadii = false;
layout(constant_id = kHasOpticalDepthsConstant) const bool kHasOpticalDepths = false;

layout(local_size_x = kProjectGroupSize) in;

layout(std140, binding = kParticlesBinding) uniform Particles { ParticlesBlock particles; };
layout(std430, binding = kOrderBinding) readonly buffer Order { OrderedParticle order[]; };
layout(std430, binding = kPositionsBinding) readonly buffer Positions { float positions[]; };
layout(std430, binding = kRadiiBinding) readonly buffer Radii { float radii[]; };
layout(std430, binding = kOpticalDepthsBinding) readonly buffer Depths { float optical_depths[]; };
layout(std430, binding = kSplatsBinding) writeonly buffer Splats { Splat splats[]; };

const float kInfinity = 1e30;
const float kHalfPi = 1.5707963267948966;

// Interval of x / w over a disc around (x, w) that does not contain the origin and lies wholly at
// w > 0.
vec2 TangentSlopes(float x, float w, float r) {
  float reach = r * sqrt(max(x * x + (w - r) * (w + r), 0.0));
  return vec2(x * w - reach, x * w + reach) / ((w - r) * (w + r));
}

// The same where the disc reaches w <= 0: only what lies at w > 0 counts.
vec2 VisibleSlopes(float x, float w, float r) {
  float distance_squared = x * x + w * w;
  if (distance_squared <= r * r) return vec2(-kInfinity, kInfinity);
  float middle = atan(x, w);
  float half_angle = asin(min(r * inversesqrt(distance_squared), 1.0));
  float low = middle - half_angle;
  float high = middle + half_angle;
  return vec2(low <= -kHalfPi ? -kInfinity : low >= kHalfPi ? kInfinity : tan(low),
              high >= kHalfPi ? kInfinity : high <= -kHalfPi ? -kInfinity : tan(high));
}

void main() {
  uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint place = group * kProjectGroupSize + gl_LocalInvocationID.x;
  if (place >= particles.count.x) return;
  uint i = order[place].index;
  float radius = kHasRadii ? radii[i] : particles.uniforms.x;
  float optical_depth = kHasOpticalDepths ? optical_depths[i] : particles.uniforms.y;
  optical_depth *= projection.target_size.w;

  vec3 view =
      ViewFromOffset(vec3(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]));
  float w = -view.z;

  // A light buffer cannot show particles smaller than its texels: enlarge them, keeping the
  // integral of their optical depth.
  float least_radius = projection.target_size.z * (kOrthographic ? 1.0 : max(w, 0.0));
  if (radius < least_radius) {
    float shrink = radius / least_radius;
    optical_depth *= shrink * shrink;
    radius = least_radius;
  }

  Splat splat;
  splat.optics = vec4(optical_depth, 0.0, 0.0, 0.0);
  vec2 xs;
  vec2 ys;
  bool visible;
  if (kOrthographic) {
    splat.center = vec4(view.xy, w, radius);
    xs = view.x + vec2(-radius, radius);
    ys = view.y + vec2(-radius, radius);
    visible = w > 0.0;
  } else if (w > radius) {
    splat.center = vec4(view.xy / w, w, radius);
    xs = TangentSlopes(view.x, w, radius);
    ys = TangentSlopes(view.y, w, radius);
    visible = true;
  } else {
    splat.center = vec4(view, radius);
    splat.optics.y = 1.0;
    xs = VisibleSlopes(view.x, w, radius);
    ys = VisibleSlopes(view.y, w, radius);
    visible = w > -radius;
  }

  // Pixels whose centres may be inside, and one more against rounding.
  vec2 corner_a = vec2(xs.x, ys.y) * projection.pixel_from_plane.xy + projection.pixel_from_plane.zw;
  vec2 corner_b = vec2(xs.y, ys.x) * projection.pixel_from_plane.xy + projection.pixel_from_plane.zw;
  vec2 low = clamp(floor(corner_a - 0.5), vec2(0.0), projection.target_size.xy);
  vec2 high = clamp(ceil(corner_b + 0.5), vec2(0.0), projection.target_size.xy);
  visible = visible && all(lessThan(low, high));
  splat.rect = visible ? vec4(low, high) : vec4(0.0);
  splats[place] = splat;
}
