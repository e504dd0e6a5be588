// The inner loops of the light sweep, over one tile or one line of the light buffer, for the best
// instruction set of the machine. Plain arrays in and out; no allocation, no threads.
#pragma once

#include <cstdint>

namespace halflight::sweep {

// Pixels along each side of a tile of the image, texels along each side of one of the light buffer.
inline constexpr int kImageTile = 8;
inline constexpr int kLightTile = 64;
// Lights that a tile composites at once.
inline constexpr int kMaxTileLights = 32;

// A particle as a target sees it. With `scaled` coordinates s = (plane - center) * scale, particles
// end at |s| = 1 in the middle of an orthographic target.
struct Sprite {
  float x = 0.0F;  // centre on the plane, as in ProjectionBlock of shaders/bindings.h
  float y = 0.0F;
  float scale = 0.0F;          // depth over radius; orthographic: 1 over radius
  float optical_depth = 0.0F;  // at its centre
};

// Polynomials in scaled coordinates (x, y) are arrays of coefficients: for a = 0 to the degree
// those of x^a y^0, x^a y^1 up to the degree.
inline constexpr int kMaxDegree = 6;
constexpr int Terms(int degree) { return (degree + 1) * (degree + 2) / 2; }

// Where a target's pixels lie on its plane: pixel centre (i + 1/2) * step + first.
struct PixelGrid {
  float first_x = 0.0F;
  float first_y = 0.0F;
  float step_x = 0.0F;
  float step_y = 0.0F;
};

struct TargetShape {
  bool orthographic = false;
  bool ball = false;  // profile
};

// Part of a particle's footprint in one tile of the light buffer.
struct LightEntry {
  uint32_t sprite = 0;
  uint32_t moments = 0;  // where its sums go
  uint8_t x_begin = 0;   // texels of the tile
  uint8_t x_end = 0;
  uint8_t y_begin = 0;
  uint8_t y_end = 0;
};

constexpr int kLightTileTexels = kLightTile * kLightTile;

struct LightTileJob {
  TargetShape shape;
  PixelGrid grid;  // of the tile
  const Sprite* sprites = nullptr;
  const LightEntry* entries = nullptr;  // nearest the light first
  uint32_t entry_count = 0;
  int degree = 0;
  int channels = 1;        // optical depths of the light: one, or three for coloured light
  float met = 1.0F;        // share of the particles' optical depth that the light meets
  float* depth = nullptr;  // by channel kLightTileTexels
  // A moments index: sums over the texels that the particle covers, weighted by its optical depth
  // relative to its centre's: of the monomials (Terms(degree)), and by channel of the optical depth
  // that the light met before the particle times the monomials (as many).
  float* moments = nullptr;
  // Of layers, kLightTileTexels: the optical depth of all particles of a slab, and by sprite where
  // within the slab it lies, 0 to 1. The depth is then what lies before the slab, and stays.
  const float* slab = nullptr;
  const float* places = nullptr;
};

// Lines of texels side by side: texel after texel of one line, in which case a vector is so many of
// its texels, or kLineLanes lines at once, a vector for each step along them.
inline constexpr int kLineLanes = 8;
struct BlurLineJob {
  float* depth = nullptr;              // optical depth: `vectors` vectors, `pitch` floats apart
  const float* unscattered = nullptr;  // that of the light which stays where it is, or null
  int64_t pitch = 0;
  int vectors = 0;
  int tap = 0;                     // floats between texels of the kernel, were pitch kLineLanes
  const float* weights = nullptr;  // of texels 0 to radius away, none of them a line's length away
  int radius = 0;
  float outside = 0.0F;      // what the kernel weighs beyond these, on both sides together
  float density = 0.0F;      // not 0
  float* scratch = nullptr;  // BlurScratchFloats()
};

// Vectors of a line that are looked at together for whether there is anything to do.
inline constexpr int kBlurChunk = 8;
constexpr int64_t BlurScratchFloats(int vectors, int radius, int tap) {
  const int64_t chunks = (vectors + kBlurChunk - 1) / kBlurChunk;
  const int64_t line = chunks * (kBlurChunk * kLineLanes);
  return 3 * (line + 2 * int64_t{radius} * tap) + chunks;
}

struct Rgb {
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;
};

// The centre of a particle near the eye, in radii, view axes: it may have no scaled coordinates, or
// fills so wide an angle that they are no linear function of its offsets.
struct NearSprite {
  float center[3] = {};
};
// Scaled coordinates of a light, as they grow with the offset from the particle's centre in radii.
struct NearLight {
  float x[3] = {};
  float y[3] = {};
};

// How the particles look, nearest the eye first. A light gives a particle
// color * exp(-exponent), the exponent a polynomial of the eye's scaled coordinates; of near
// sprites a polynomial of the light's.
struct ShadedSprites {
  const Sprite* sprites = nullptr;  // scale 0: a near sprite
  const uint16_t* rows = nullptr;   // first and end row in the image, two a sprite
  const Rgb* unshadowed = nullptr;  // a sprite: what it shows without the lights that follow
  // Depth along the camera's axis, a polynomial of degree 1: three a sprite. Of near sprites: depth
  // of the centre, the radius, nothing. Null: not wanted.
  const float* depth = nullptr;
  int lights = 0;
  int exponents = 1;  // a light: one, or three for coloured density
  // By light: whether its exponent is a shadow's alone, and not below 0.
  const bool* shadow_alone = nullptr;
  int degree = 0;
  const Rgb* lit = nullptr;          // a sprite and light
  const float* exponent = nullptr;   // a sprite, light and exponent: Terms(degree) coefficients
  const NearSprite* near = nullptr;  // a sprite; null: there are none
  const NearLight* near_lights = nullptr;  // a sprite and light
};

// Planes of kImageTile^2 floats.
struct ImageTileJob {
  TargetShape shape;
  PixelGrid grid;
  ShadedSprites shaded;
  const uint32_t* entries = nullptr;  // sprites, nearest the eye first
  uint32_t entry_count = 0;
  int first_row = 0;                 // of the tile in the image
  float least_transmittance = 0.0F;  // stop where all pixels are below
  // In: what lies in front of the sprites; out: with them.
  float* pixels = nullptr;  // red, green, blue, coverage
  float* depth = nullptr;   // sum of depth times what is seen of a particle, or null
  // For each of the lights the same of exp(-exponent), three planes a light, or null.
  float* transmittance = nullptr;
};

struct Kernels {
  // With a slab: moments alone, from between the layers before and behind it. Else deposits.
  void (*sweep_light_tile)(const LightTileJob& job);
  // Adds the particles' optical depth to kLightTileTexels texels, and nothing else.
  void (*deposit_light_tile)(const LightTileJob& job, float* depth);
  // Blurs in place, as shaders/blur.frag does.
  void (*blur_line)(const BlurLineJob& job);
  void (*composite_image_tile)(const ImageTileJob& job);
};

// For the CPU this runs on; see ListKernels in kernel_sets.h.
const Kernels& BestKernels();

}  // namespace halflight::sweep
