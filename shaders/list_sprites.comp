#version 450
#extension GL_GOOGLE_include_directive : require
// Projects the particles at a run of places: sprites (x, y, scale, optical depth), the rectangles of
// pixels that may lie within, and the centres of near ones in radii.
// Bounds of a sphere under perspective: tangents from the eye in the planes of each image axis
// (Mara and McGuire 2013, "2D Polyhedral Bounds of a Clipped, Perspective-Projected 3D Sphere").
#include "bindings.h"
#include "sprites.glsl"

layout(constant_id = kHasOpticalDepthsConstant) const bool kHasOpticalDepths = false;
layout(constant_id = kHasNearConstant) const bool kHasNear = false;

layout(std430, binding = kOpticalDepthsBinding) readonly buffer Depths { float optical_depths[]; };
layout(std430, binding = kSpriteOrderBinding) readonly buffer Order { uint order[]; };
layout(std430, binding = kSpritesBinding) writeonly buffer Sprites { vec4 sprites[]; };
layout(std430, binding = kSpriteRectsBinding) writeonly buffer Rects { uvec2 rects[]; };
layout(std430, binding = kNearSpritesBinding) writeonly buffer Near { vec4 near[]; };

const double kInfinity = 1e30lf;

// What TangentSlopes() and VisibleSlopes() in renderer say, in the same steps.
dvec2 TangentSlopes(double x, double w, double r) {
  precise double reach = r * sqrt(x * x + (w - r) * (w + r));
  precise dvec2 slopes = dvec2(x * w - reach, x * w + reach) / ((w - r) * (w + r));
  return slopes;
}
dvec2 VisibleSlopes(double x, double w, double r) {
  precise double tangent_squared = x * x + (w - r) * (w + r);
  if (tangent_squared <= 0.0) return dvec2(-kInfinity, kInfinity);
  precise double tangent = sqrt(tangent_squared);
  precise dvec2 low = dvec2(x * tangent - w * r, w * tangent + x * r);
  precise dvec2 high = dvec2(x * tangent + w * r, w * tangent - x * r);
  return dvec2(low.y > 0.0 ? low.x / low.y : -kInfinity,
               high.y > 0.0 ? high.x / high.y : kInfinity);
}

uvec2 RectOf(dvec2 xs, dvec2 ys) {
  precise dvec2 a = dvec2(xs.x, ys.y) * target.pixel_from_plane.xy + target.pixel_from_plane.zw;
  precise dvec2 b = dvec2(xs.y, ys.x) * target.pixel_from_plane.xy + target.pixel_from_plane.zw;
  precise dvec2 low = clamp(floor(a - 0.501lf) + 1.0, dvec2(0.0), target.size.xy);
  precise dvec2 high = clamp(floor(b - 0.499lf) + 1.0, dvec2(0.0), target.size.xy);
  if (!(low.x < high.x && low.y < high.y)) return uvec2(0u);
  return uvec2(low) | uvec2(high) << 16u;
}

void main() {
  uint k = InvocationIndex();
  if (k >= target.run.x) return;
  uint i = order[k];
  dvec3 view = ViewOf(i);
  double w = -view.z;
  double radius = DrawnRadius(i, w);
  // Enlarged particles keep their integral.
  precise double shrink = RadiusOf(i) / radius;
  precise double optical_depth =
      double(kHasOpticalDepths ? optical_depths[i] : particles.uniforms.y) * (shrink * shrink);

  vec4 sprite = vec4(0.0);
  uvec2 rect = uvec2(0u);
  vec3 center = vec3(0.0);
  if (kOrthographic) {
    if (w > 0.0) {
      sprite = vec4(dvec4(view.xy, 1.0 / radius, optical_depth));
      rect = RectOf(view.x + dvec2(-radius, radius), view.y + dvec2(-radius, radius));
    }
  } else if (w > -radius) {
    bool is_near = w <= target.near_depths.x * radius;
    bool reaches_plane = w <= target.near_depths.y * radius;
    sprite = vec4(is_near ? dvec4(0.0, 0.0, 0.0, optical_depth)
                          : dvec4(view.xy / w, w / radius, optical_depth));
    if (is_near) center = vec3(view / radius);
    rect = reaches_plane
               ? RectOf(VisibleSlopes(view.x, w, radius), VisibleSlopes(view.y, w, radius))
               : RectOf(TangentSlopes(view.x, w, radius), TangentSlopes(view.y, w, radius));
  }
  sprites[k] = sprite;
  rects[k] = rect;
  if (kHasNear) near[k] = vec4(center, 0.0);
}
