// What C++ and GLSL share: binding points, uniform blocks (std140), storage records (std430) and
// the numbers of specialisation constants. Compiled as both languages.
#ifndef HALFLIGHT_SHADERS_BINDINGS_H_
#define HALFLIGHT_SHADERS_BINDINGS_H_

#ifdef __cplusplus
#include <cstdint>

#include <glm/ext/vector_int4.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

namespace halflight::shader {
using glm::ivec4;
using glm::mat4;
using glm::uvec4;
using glm::vec4;
using uint = uint32_t;
#define HALFLIGHT_CONSTANT(name, value) inline constexpr uint name = value
#else
#define HALFLIGHT_CONSTANT(name, value) const uint name = value
#endif

// Uniform blocks.
HALFLIGHT_CONSTANT(kProjectionBinding, 0);
HALFLIGHT_CONSTANT(kParticlesBinding, 1);
HALFLIGHT_CONSTANT(kCompositeBinding, 2);
HALFLIGHT_CONSTANT(kBlurBinding, 3);
HALFLIGHT_CONSTANT(kResolveBinding, 4);

// Storage buffers.
HALFLIGHT_CONSTANT(kOrderBinding, 0);          // OrderedParticle[]
HALFLIGHT_CONSTANT(kPositionsBinding, 1);      // float[3 N]
HALFLIGHT_CONSTANT(kRadiiBinding, 2);          // float[N]
HALFLIGHT_CONSTANT(kOpticalDepthsBinding, 3);  // float[N]
HALFLIGHT_CONSTANT(kColorsBinding, 4);         // float[3 N]
HALFLIGHT_CONSTANT(kEmissionsBinding, 5);      // float[3 N]
HALFLIGHT_CONSTANT(kSplatsBinding, 6);         // Splat[N], as the eye sees the particles
HALFLIGHT_CONSTANT(kLightSplatsBinding, 7);    // Splat[N], as the light does

// Textures.
HALFLIGHT_CONSTANT(kLightBeforeBinding, 0);  // light buffer without the current slice
HALFLIGHT_CONSTANT(kLightAfterBinding, 1);   // light buffer with it
HALFLIGHT_CONSTANT(kSourceBinding, 0);       // what a full-screen pass reads

// Specialisation constants.
HALFLIGHT_CONSTANT(kOrthographicConstant, 0);
HALFLIGHT_CONSTANT(kBallProfileConstant, 1);
HALFLIGHT_CONSTANT(kHasRadiiConstant, 2);
HALFLIGHT_CONSTANT(kHasOpticalDepthsConstant, 3);
HALFLIGHT_CONSTANT(kHasColorsConstant, 4);
HALFLIGHT_CONSTANT(kHasEmissionsConstant, 5);
HALFLIGHT_CONSTANT(kShadowedConstant, 6);
HALFLIGHT_CONSTANT(kPointShadowLightConstant, 7);
HALFLIGHT_CONSTANT(kInterpolateConstant, 8);
HALFLIGHT_CONSTANT(kColoredLightBufferConstant, 9);
HALFLIGHT_CONSTANT(kPhaseConstant, 10);
HALFLIGHT_CONSTANT(kDepthOutputConstant, 11);
HALFLIGHT_CONSTANT(kTransmittanceOutputConstant, 12);
HALFLIGHT_CONSTANT(kEnlargeConstant, 13);
HALFLIGHT_CONSTANT(kNearEyeConstant, 14);
HALFLIGHT_CONSTANT(kColoredDensityConstant, 15);
HALFLIGHT_CONSTANT(kVaryingLightsConstant, 16);
HALFLIGHT_CONSTANT(kShadowLightVariesConstant, 17);
HALFLIGHT_CONSTANT(kUnscatteredLightConstant, 18);

HALFLIGHT_CONSTANT(kProjectGroupSize, 64);
HALFLIGHT_CONSTANT(kMaxLightsInTraversal, 16);
HALFLIGHT_CONSTANT(kMaxBlurRadius, 63);  // texels to each side

// A projection onto a target's pixels, the eye's or a light's. "Plane" coordinates are x / w, y / w
// with w the depth along the axis (perspective), or x, y in world units (orthographic); y is up.
// Pixel coordinates count from the target's first row, which is the top of the image.
struct ProjectionBlock {
  mat4 view_from_world;  // rotation only
  // Particle origin minus eye, in two parts (xyz): near_translation, world axes, is added before
  // the rotation, far_translation, view axes, after it. Near the eye the first sum is exact; far
  // from it the second leaves what lies across the view its digits.
  vec4 near_translation;
  vec4 far_translation;
  vec4 pixel_from_plane;  // xy: scale, zw: offset
  vec4 plane_from_pixel;  // the inverse
  vec4 target_size;       // xy: pixels; z: radii below this are drawn as this (plane units);
                          // w: scale of optical depths
  vec4 band;              // pixels of the target that are drawn: xy: the first, zw: how many
};

// Values that serve where the particle set has no attribute of its own.
struct ParticlesBlock {
  vec4 uniforms;  // x: radius, y: optical depth
  uvec4 count;    // x
};

// One place in the sorted sequence of particles.
struct OrderedParticle {
  uint index;   // of the particle in its set
  float place;  // within its slice, 0 (first) to 1 (last)
};

// A particle seen along a projection.
struct Splat {
  vec4 rect;    // pixels that it may touch: min x, min y, max x, max y; empty when unseen
  vec4 center;  // general == 0: plane coordinates and depth w, else view coordinates; w: radius
  vec4 optics;  // x: optical depth at the centre; y: general, 1 where depth <= radius
};

// A light whose radiance at a particle depends on the ray or on the place.
struct LightBlock {
  vec4 color;   // rgb; w: 1 with inverse square falloff
  vec4 vector;  // view axes; direction of travel (w = 0) or position (w = 1)
};

struct CompositeBlock {
  mat4 light_view_from_view;      // rotation only; of the light that casts shadows
  vec4 light_texture_from_plane;  // xy: scale, zw: offset, to texture coordinates
  vec4 albedo;                    // rgb; w: phase g
  vec4 emission;                  // rgb
  vec4 density;                   // rgb shadow density
  vec4 constant_light;            // rgb; unshadowed and the same everywhere, ambient included
  vec4 constant_shadowed;         // rgb; the shadow casting light, where the same everywhere
  LightBlock lights[kMaxLightsInTraversal];  // that vary; the one that casts shadows is the first
};

struct BlurBlock {
  uvec4 axis;                        // x, y: step in texels; z: radius in texels
  vec4 density;                      // rgb shadow density of the light
  vec4 weights[kMaxBlurRadius + 1];  // rgb, by distance from the centre
};

struct ResolveBlock {
  ivec4 factor;  // x: samples (or pixels, when enlarging) along each side
  ivec4
      first;   // of the band that is drawn: xy: its first pixel, zw: the first sample of the source
  ivec4 size;  // xy: samples of all bands
};

#undef HALFLIGHT_CONSTANT
#ifdef __cplusplus
}  // namespace halflight::shader
#endif

#endif  // HALFLIGHT_SHADERS_BINDINGS_H_
