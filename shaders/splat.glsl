// How a ray meets a particle: the image model's impact parameter, well conditioned at any distance.
// The same functions serve eye rays and light rays. Included after bindings.h.
#include "opacity.glsl"

layout(constant_id = kOrthographicConstant) const bool kOrthographic = false;
// Whether particles reach the plane through the eye, so that the general encounter is met.
layout(constant_id = kNearEyeConstant) const bool kNearEye = false;
layout(constant_id = kBallProfileConstant) const bool kBallProfile = false;

layout(std140, binding = kProjectionBinding) uniform Projections { ProjectionBlock projection; };

// From an offset from the particle set's origin.
vec3 ViewFromOffset(vec3 offset) {
  return mat3(projection.view_from_world) * (offset + projection.near_translation.xyz) +
         projection.far_translation.xyz;
}

// Where a ray passes a particle.
struct Encounter {
  float rho_squared;  // squared impact parameter over squared radius
  vec3 offset;        // from the particle's centre to the ray's closest point, view axes
  vec3 ray;           // along the ray, away from the eye; view axes, not normalised
  bool in_front;      // of the eye
};

// `pixel` is that of the band.
vec2 PlaneFromPixel(vec2 pixel) {
  return (pixel + projection.band.xy) * projection.plane_from_pixel.xy +
         projection.plane_from_pixel.zw;
}

// With D = (plane, -1) the ray and o = w (c, -1) the centre, o x D = w ((c, -1) x (plane - c, 0)):
// built from the offset to the centre, never from two large numbers.
Encounter MeetParticle(vec2 pixel, vec4 center, bool general) {
  Encounter e;
  vec2 plane = PlaneFromPixel(pixel);
  vec2 delta = plane - center.xy;
  e.in_front = true;
  if (kOrthographic) {
    e.ray = vec3(0.0, 0.0, -1.0);
    e.offset = vec3(delta, 0.0);
    e.rho_squared = dot(delta, delta) / (center.w * center.w);
    return e;
  }
  e.ray = vec3(plane, -1.0);
  vec3 moment = center.z * vec3(delta.y, -delta.x, center.x * delta.y - center.y * delta.x);
  if (kNearEye && general) {
    moment = cross(center.xyz, e.ray);
    e.in_front = dot(center.xyz, e.ray) > 0.0;
  }
  float inverse_length_squared = 1.0 / dot(e.ray, e.ray);
  e.rho_squared =
      dot(moment, moment) * inverse_length_squared / (center.w * center.w);
  e.offset = cross(moment, e.ray) * inverse_length_squared;
  return e;
}

// Optical depth relative to the centre's.
float ProfileWeight(float rho_squared) {
  float w = max(1.0 - rho_squared, 0.0);
  return kBallProfile ? sqrt(w) : w;
}

// Corner 0 to 3 of a splat's rectangle in the band's clip space, whose row 0 is at y = -1.
vec4 RectCorner(vec4 rect, int corner) {
  vec2 pixel = vec2((corner & 1) == 0 ? rect.x : rect.z, (corner & 2) == 0 ? rect.y : rect.w);
  return vec4((pixel - projection.band.xy) / projection.band.zw * 2.0 - 1.0, 0.0, 1.0);
}
