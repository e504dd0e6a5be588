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
using glm::dvec4;
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
HALFLIGHT_CONSTANT(kScanBinding, 5);
HALFLIGHT_CONSTANT(kSortBinding, 6);
HALFLIGHT_CONSTANT(kSpriteTargetBinding, 7);
HALFLIGHT_CONSTANT(kTilesBinding, 8);
HALFLIGHT_CONSTANT(kPlaceRunBinding, 9);
HALFLIGHT_CONSTANT(kInverseGramBinding, 10);
HALFLIGHT_CONSTANT(kShadeBinding, 11);
HALFLIGHT_CONSTANT(kTileCompositeBinding, 12);
HALFLIGHT_CONSTANT(kSliceWalkBinding, 13);

// Storage buffers.
HALFLIGHT_CONSTANT(kOrderBinding, 0);          // OrderedParticle[]
HALFLIGHT_CONSTANT(kPositionsBinding, 1);      // float[3 N]
HALFLIGHT_CONSTANT(kRadiiBinding, 2);          // float[N]
HALFLIGHT_CONSTANT(kOpticalDepthsBinding, 3);  // float[N]
HALFLIGHT_CONSTANT(kColorsBinding, 4);         // float[3 N]
HALFLIGHT_CONSTANT(kEmissionsBinding, 5);      // float[3 N]
HALFLIGHT_CONSTANT(kSplatsBinding, 6);         // Splat[N], as the eye sees the particles
HALFLIGHT_CONSTANT(kLightSplatsBinding, 7);    // Splat[N], as the light does

// Those of a prefix sum.
HALFLIGHT_CONSTANT(kScanValuesBinding, 0);     // uint[N]
HALFLIGHT_CONSTANT(kScanPrefixBinding, 1);     // uint[N + 1]
HALFLIGHT_CONSTANT(kScanBlockSumsBinding, 2);  // uint[blocks]
// Those of a sort.
HALFLIGHT_CONSTANT(kSortKeysBinding, 0);      // uint[N]
HALFLIGHT_CONSTANT(kSortValuesBinding, 1);    // uint[N]
HALFLIGHT_CONSTANT(kSortTableBinding, 2);     // uint[digits * blocks + 1]
HALFLIGHT_CONSTANT(kSortedKeysBinding, 3);    // uint[N]
HALFLIGHT_CONSTANT(kSortedValuesBinding, 4);  // uint[N]
// Those of a list of sprites, beside the particles' own.
HALFLIGHT_CONSTANT(kSpriteKeysBinding, 4);   // uint[N]
HALFLIGHT_CONSTANT(kSpriteOrderBinding, 0);  // uint[N]
HALFLIGHT_CONSTANT(kSpritesBinding, 4);      // vec4[N]
HALFLIGHT_CONSTANT(kSpriteRectsBinding, 5);  // uvec2[N]
HALFLIGHT_CONSTANT(kNearSpritesBinding, 6);  // vec4[N]
// Those of tile lists.
HALFLIGHT_CONSTANT(kTileRectsBinding, 0);    // uvec2[N]
HALFLIGHT_CONSTANT(kEntryBeginsBinding, 1);  // uint[N + 1]
HALFLIGHT_CONSTANT(kEntryTilesBinding, 2);   // uint[entries]
HALFLIGHT_CONSTANT(kEntryPlacesBinding, 3);  // uint[entries]
HALFLIGHT_CONSTANT(kTileBeginsBinding, 4);   // uint[tiles + 1]
// Those of the light sweep; by place: nearest the light first.
HALFLIGHT_CONSTANT(kLightSpritesBinding, 0);      // vec4[N]: x, y, scale, optical depth
HALFLIGHT_CONSTANT(kLightRectsBinding, 1);        // uvec2[N]: begin | end << 16 along x, along y
HALFLIGHT_CONSTANT(kPatchOffsetsBinding, 2);      // uint[N]: within a group of places
HALFLIGHT_CONSTANT(kGroupOffsetsBinding, 3);      // uint[groups], modulo 2^32; before: texels
HALFLIGHT_CONSTANT(kPatchesBinding, 4);           // float[]: each particle's rectangle, row by row
HALFLIGHT_CONSTANT(kLightTileBeginBinding, 5);    // uint[tiles + 1]
HALFLIGHT_CONSTANT(kLightTileEntriesBinding, 6);  // uint[]: places
HALFLIGHT_CONSTANT(kLightDepthBinding, 7);        // float[texels], row by row
// Those of its fit, beside the first five.
HALFLIGHT_CONSTANT(kLightParticlesBinding, 5);  // uint[N]: index of the particle in its set
HALFLIGHT_CONSTANT(kFittedDepthBinding, 6);     // float[terms * N], by particle
HALFLIGHT_CONSTANT(kFittedSpritesBinding, 7);   // vec4[N], by particle
// Those of the light sweep's shading; beside them, those of the particles.
HALFLIGHT_CONSTANT(kEyeParticlesBinding, 0);  // uint[count]: index in the set, by place
HALFLIGHT_CONSTANT(kEyeNearBinding, 3);       // vec4[count], by place
HALFLIGHT_CONSTANT(kFitDepthBinding, 4);      // float[terms * N]
HALFLIGHT_CONSTANT(kFitSpritesBinding, 5);    // vec4[N]
HALFLIGHT_CONSTANT(kEyeSpritesBinding, 6);    // vec4[count], by place
HALFLIGHT_CONSTANT(kShadedBinding, 7);        // what the pass writes, by place
// Those of the tile compositor.
HALFLIGHT_CONSTANT(kTileHeadsBinding, 0);    // vec4[], as shade_sprites.comp writes them
HALFLIGHT_CONSTANT(kTileLightsBinding, 1);   // float[], as shade_light.comp writes them
HALFLIGHT_CONSTANT(kTileBeginBinding, 2);    // uint[tiles + 1]
HALFLIGHT_CONSTANT(kTileEntriesBinding, 3);  // uint[]: places
// Those of slices in tiles, beside the particles' colours, emissions, order and splats.
HALFLIGHT_CONSTANT(kSliceTileBeginBinding, 1);    // uint[tiles + 1]
HALFLIGHT_CONSTANT(kSliceTileEntriesBinding, 2);  // uint[]: places
HALFLIGHT_CONSTANT(kSliceBeginsBinding, 3);       // uint[slices + 1]: places
HALFLIGHT_CONSTANT(kSplatRectsBinding, 5);        // uvec2[N]

// Images.
HALFLIGHT_CONSTANT(kTileTargetBinding, 0);           // premultiplied
HALFLIGHT_CONSTANT(kDepthTargetBinding, 1);          // depth * alpha, 0, 0, alpha
HALFLIGHT_CONSTANT(kTransmittanceTargetBinding, 2);  // R G B * alpha, alpha
HALFLIGHT_CONSTANT(kLightTargetBinding, 0);          // a light buffer
HALFLIGHT_CONSTANT(kLayersTargetBinding, 1);         // an array of them

// Textures.
HALFLIGHT_CONSTANT(kLightBeforeBinding, 0);  // light buffer without the current slice
HALFLIGHT_CONSTANT(kLightAfterBinding, 1);   // light buffer with it
HALFLIGHT_CONSTANT(kSourceBinding, 0);       // what a full-screen pass reads
HALFLIGHT_CONSTANT(kLightLayersBinding, 0);  // light buffers that a run of slices sees

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
HALFLIGHT_CONSTANT(kNumberItemsConstant, 19);
HALFLIGHT_CONSTANT(kHasNearConstant, 20);
HALFLIGHT_CONSTANT(kLightTileSizeConstant, 21);
HALFLIGHT_CONSTANT(kFitDegreeConstant, 22);
HALFLIGHT_CONSTANT(kTileColumnsConstant, 30);
HALFLIGHT_CONSTANT(kTileRowsConstant, 31);
HALFLIGHT_CONSTANT(kTileChunkConstant, 32);
HALFLIGHT_CONSTANT(kTileLightsConstant, 33);
HALFLIGHT_CONSTANT(kTileShowsConstant, 34);
HALFLIGHT_CONSTANT(kBackToFrontConstant, 35);

// Values of kTileShowsConstant: what the tile compositor makes an image of.
HALFLIGHT_CONSTANT(kShowsColor, 0);
HALFLIGHT_CONSTANT(kShowsDepth, 1);
HALFLIGHT_CONSTANT(kShowsTransmittance, 2);

HALFLIGHT_CONSTANT(kProjectGroupSize, 64);
HALFLIGHT_CONSTANT(kShadeGroupSize, 64);
HALFLIGHT_CONSTANT(kMaxLightsInTiles, 32);
HALFLIGHT_CONSTANT(kScanGroupSize, 256);
HALFLIGHT_CONSTANT(kScanPerInvocation, 8);
HALFLIGHT_CONSTANT(kSortGroupSize, 256);  // and digits a pass
HALFLIGHT_CONSTANT(kSortRounds, 16);
HALFLIGHT_CONSTANT(kListGroupSize, 256);
HALFLIGHT_CONSTANT(kSliceChunk, 64);  // particles of a slice that a tile loads at once
// Texels in the patches of one run, at most: 64 MiB. Keeps the loops over them below the 65,535
// iterations after which llvmpipe ends those of an invocation, and sums of 256 below 2^32.
HALFLIGHT_CONSTANT(kMaxPatchTexels, 0xFFFFFFu);
HALFLIGHT_CONSTANT(kSweepChunk, 64);  // particles that a light tile loads at once
HALFLIGHT_CONSTANT(kFitGroupSize, 128);
HALFLIGHT_CONSTANT(kFitTeamSize, 8);     // invocations that fit a particle of few rows
HALFLIGHT_CONSTANT(kMaxGramWords, 196);  // vec4: 28 terms squared
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

// A run of the light's order.
struct PlaceRunBlock {
  uvec4 run;  // places [x, y); z: texels along each side of the light buffer, or of a square that
              // is counted; w: of its patches, where the first begins among all, modulo 2^32
};

// Of the monomials over the disc: sweep/polynomial.h.
struct InverseGramBlock {
  vec4 rows[kMaxGramWords];  // terms by terms floats
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

// The part of a prefix sum that one dispatch sees.
struct ScanBlock {
  uvec4 count;   // x: values, y: sums
  uvec4 blocks;  // x: of this part, y: before it
};

// A pass of a radix sort.
struct SortBlock {
  uvec4 pass;  // x: items, y: the digit's lowest bit, z: blocks
};

// The light sweep's shading: of all lights, or of one.
struct ShadeBlock {
  mat4 light_view_from_view;  // rotation only; of a light that casts shadows
  LightBlock light;           // a light that varies
  vec4 albedo;                // rgb; w: phase g
  vec4 emission;              // rgb
  vec4 constant_light;        // rgb; unshadowed and the same everywhere, ambient included
  vec4 density;               // rgb shadow density
  uvec4 range;                // x: places; y: the light's slot, z: slots
};

struct TileCompositeBlock {
  uvec4 walk;   // entries of each tile's list: x: the first, y: how many; z: first shaded place
  uvec4 slots;  // x: the first that is shown, y: of each particle
  uvec4 tiles;  // xy: the one that the target begins with; z: across the image
  vec4 colors[kMaxLightsInTiles];  // by slot: rgb; w: least exponent
};

// What one dispatch walks of the slices, in tiles of the image or of the light buffer. The slices
// [first, end) of a run have layers of their own: slice s sees layer (s - first) * step, and with
// itself in it the one after.
struct SliceWalkBlock {
  uvec4 slices;  // the image: x: the first, y: the end, z: step; the light: those that begin here
  uvec4 window;  // the image: entries of each tile's list: x: the first, y: how many; the light:
                 // places [x, y), z: the run's first slice
};

// What a list of sprites is seen from, in float64: depths then order particles as they do on the
// CPU.
struct SpriteTargetBlock {
  dvec4 view_from_world[3];  // columns of the rotation (xyz)
  dvec4 origin_from_eye;     // xyz, world axes
  dvec4 pixel_from_plane;    // xy: scale, zw: offset
  dvec4 size;                // xy: pixels; z: radii below this are drawn as this (plane units)
  dvec4 near_depths;         // in radii; x: of near particles, y: of those that may reach the eye
  uvec4 run;                 // x: places that one dispatch lists
  uvec4 padding;             // to a multiple of a dvec4
};

// Which entries of tile lists one dispatch makes.
struct TilesBlock {
  uvec4 tiles;    // xy: across and down, z: pixels along a side
  uvec4 run;      // x: first place in the bound rectangles, y: places, z: first place
  uvec4 entries;  // x
};

#undef HALFLIGHT_CONSTANT
#ifdef __cplusplus
}  // namespace halflight::shader
#endif

#endif  // HALFLIGHT_SHADERS_BINDINGS_H_
