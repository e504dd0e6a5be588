// A particle of the light's order on the light buffer. Included after splat.glsl.

layout(std140, binding = kPlaceRunBinding) uniform PlaceRun { PlaceRunBlock places; };
layout(std430, binding = kLightSpritesBinding) readonly buffer Sprites { vec4 sprites[]; };
layout(std430, binding = kLightRectsBinding) readonly buffer Rects { uvec2 rects[]; };
layout(std430, binding = kPatchOffsetsBinding) readonly buffer Offsets { uint patch_offsets[]; };
layout(std430, binding = kGroupOffsetsBinding) readonly buffer Groups { uint group_offsets[]; };

// Texels [begin.x, begin.x + extent.x) by [begin.y, begin.y + extent.y).
struct TexelRect {
  uvec2 begin;
  uvec2 extent;
};

TexelRect RectAt(uint place) {
  uvec2 begin = rects[place] & 0xFFFFu;
  return TexelRect(begin, (rects[place] >> 16) - begin);
}

// Where in the run's patches the particle's begins. They hold fewer than 2^32 texels, so that sums
// modulo 2^32 tell.
uint PatchOffset(uint place) {
  return group_offsets[place / kScanGroupSize] + patch_offsets[place] - places.run.w;
}

// PlaneFromPixel of splat.glsl with the digits that small particles need: the first difference is
// exact, whereas the sum there is of numbers as large as the light buffer.
vec2 PlaneFromTexel(vec2 texel) {
  return (texel - projection.pixel_from_plane.zw) * projection.plane_from_pixel.xy;
}

// Optical depth relative to the centre's, at scaled coordinates s on the light ray through `plane`:
// MeetParticle of splat.glsl for a sprite. `inverse_length` is 1 / |ray|^2.
float SpriteWeight(vec2 s, vec4 sprite, float inverse_length) {
  float rho_squared = dot(s, s);
  if (!kOrthographic) {
    float turn = sprite.x * s.y - sprite.y * s.x;
    rho_squared = (rho_squared + turn * turn) * inverse_length;
  }
  return ProfileWeight(rho_squared);
}

float InverseRayLength(vec2 plane) { return kOrthographic ? 1.0 : 1.0 / (dot(plane, plane) + 1.0); }
