// The yardstick's inner loops, for x86-64 with AVX2 and FMA: plain arrays in and out.
// Leaves out threads, sorting and lists; see yardstick.cpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace halflight::bench::kernels {

inline constexpr int kTile = 8;  // pixels along each side

// How the eye and the light see a place: of each axis the coefficients of x, y, z and 1.
struct Views {
  float eye[3][4];    // right, up, forward
  float light[3][4];  // right, down, along the light
};

// Of particles in the set's order; arrays of as many floats as there are particles.
struct Placed {
  float* x;  // along the eye's right, up and forward
  float* y;
  float* z;
  float* right;  // along the light's
  float* down;
  uint32_t* eye_key;  // ascend with the distance from the eye, and along the light
  uint32_t* light_key;
};

struct Bounds {
  float least_z = 3e38F;
  float right[2] = {3e38F, -3e38F};  // lowest and highest
  float down[2] = {3e38F, -3e38F};
};

// `positions` has three floats a particle.
Bounds Project(const float* positions, size_t begin, size_t end, const Views& views,
               const Placed& out);

// The light buffer: optical depth met so far. Rows have `stride` floats, eight more than texels.
struct LightBuffer {
  float* depth;
  size_t stride;
  float radius_columns;  // of a particle, texels
  float radius_rows;
  float optical_depth;  // of a particle, at its centre
};

// Takes particles through rows [first_row, end_row) of the buffer. `columns` and `rows` are their
// places, nearest the light first. For each: sums over the texels under it, weighted by its
// profile, of 1 and of what the light met before it.
void Sweep(const LightBuffer& buffer, int first_row, int end_row, const float* columns,
           const float* rows, size_t count, float* weights, float* depths);

// A particle on the image: where `u` and `v` are pixels right and down from its centre, it covers
// what has (a u^2 + b u v + c v^2) / |ray|^2 < 1, the ray having length 1 along the view.
struct Sprite {
  float x;  // pixels
  float y;
  float a;
  float b;
  float c;
  float red;  // before opacity
  float green;
  float blue;
};
struct Rect {
  int16_t x_begin;
  int16_t x_end;
  int16_t y_begin;
  int16_t y_end;
};

struct Lens {
  float center_x;  // pixels: where the view direction meets the image
  float center_y;
  float pixels_per_slope;
  float radius;
  int width;
  int height;
};

// Colour is `dark` plus `lit` times exp(-density * depth).
struct Look {
  float dark[3];
  float lit[3];
  float density;
};

// Particles order[begin..end), in that order, into sprites and rectangles of the same places.
// `depth` is what their light has met, by particle.
void Shade(const uint32_t* order, size_t begin, size_t end, const Placed& placed,
           const float* depth, const Lens& lens, const Look& look, Sprite* sprites, Rect* rects);

// One entry of a tile's list: the sprite, and rows [first, last] of the tile that it may cover.
constexpr uint32_t kSpriteBits = 24;
constexpr uint32_t EntryOf(uint32_t sprite, uint32_t first_row, uint32_t last_row) {
  return sprite | first_row << kSpriteBits | last_row << (kSpriteBits + 4);
}

// Opacity is w (o[0] + w (o[1] + w (o[2] + w o[3]))) where the profile is w.
struct Opacity {
  float of_power[4];
};

// Front to back over the tile at pixel (x, y), until no more than `enough` shines through. Writes
// red, green, blue and coverage of the pixels that lie in the image.
void Composite(const uint32_t* entries, size_t count, const Sprite* sprites, const Opacity& opacity,
               const Lens& lens, int x, int y, float enough, float* pixels);

}  // namespace halflight::bench::kernels
