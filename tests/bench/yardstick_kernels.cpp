// Compiled for AVX2 and FMA, and called only where they are there. Includes nothing with functions
// of its own that other files might be linked to.
#include "tests/bench/yardstick_kernels.h"

#include "renderer/sweep/simd.h"

namespace halflight::bench::kernels {
namespace {

using namespace simd;  // NOLINT(google-build-using-namespace): every line below is made of it

// Unsigned integers of the same order as floats.
HALFLIGHT_INLINE uint32_t KeyOf(float value) {
  uint32_t bits = 0;
  __builtin_memcpy(&bits, &value, sizeof(bits));
  return bits ^ (static_cast<uint32_t>(static_cast<int32_t>(bits) >> 31) | 0x80000000U);
}

HALFLIGHT_INLINE float Along(const float (&axis)[4], const float* p) {
  return axis[0] * p[0] + (axis[1] * p[1] + (axis[2] * p[2] + axis[3]));
}

HALFLIGHT_INLINE void Widen(float value, float (&range)[2]) {
  range[0] = value < range[0] ? value : range[0];
  range[1] = value > range[1] ? value : range[1];
}

HALFLIGHT_INLINE int Floor(float value) {
  const int whole = static_cast<int>(value);
  return whole - (static_cast<float>(whole) > value ? 1 : 0);
}
HALFLIGHT_INLINE int Clamp(int value, int low, int high) {
  return value < low ? low : (value > high ? high : value);
}
// The first pixel, or texel, whose centre is not below `value`.
HALFLIGHT_INLINE int FirstFrom(float value) { return Floor(value + 0.5F); }

HALFLIGHT_INLINE Floats Centers() { return Floats{0.5F, 1.5F, 2.5F, 3.5F, 4.5F, 5.5F, 6.5F, 7.5F}; }

HALFLIGHT_INLINE float Largest(const Floats& x) {
  float largest = x[0];
  for (int lane = 1; lane < kLanes; ++lane) largest = x[lane] > largest ? x[lane] : largest;
  return largest;
}

}  // namespace

Bounds Project(const float* positions, size_t begin, size_t end, const Views& views,
               const Placed& out) {
  Bounds bounds;
  for (size_t i = begin; i < end; ++i) {
    const float* const p = positions + 3 * i;
    const float x = Along(views.eye[0], p);
    const float y = Along(views.eye[1], p);
    const float z = Along(views.eye[2], p);
    const float right = Along(views.light[0], p);
    const float down = Along(views.light[1], p);
    out.x[i] = x;
    out.y[i] = y;
    out.z[i] = z;
    out.right[i] = right;
    out.down[i] = down;
    out.eye_key[i] = KeyOf(x * x + y * y + z * z);
    out.light_key[i] = KeyOf(Along(views.light[2], p));
    bounds.least_z = z < bounds.least_z ? z : bounds.least_z;
    Widen(right, bounds.right);
    Widen(down, bounds.down);
  }
  return bounds;
}

float Sum(const Floats& x) {
  return ((x[0] + x[4]) + (x[1] + x[5])) + ((x[2] + x[6]) + (x[3] + x[7]));
}

void Sweep(const LightBuffer& buffer, int first_row, int end_row, const float* columns,
           const float* rows, size_t count, float* weights, float* depths) {
  const float per_column = 1.0F / buffer.radius_columns;
  const float per_row = 1.0F / buffer.radius_rows;
  const Floats centers = Centers() * per_column;
  for (size_t i = 0; i < count; ++i) {
    const int top = FirstFrom(rows[i] - buffer.radius_rows);
    const int bottom = FirstFrom(rows[i] + buffer.radius_rows);
    const int left = FirstFrom(columns[i] - buffer.radius_columns);
    const int right = FirstFrom(columns[i] + buffer.radius_columns);
    Floats weight{};
    Floats depth{};
    for (int row = top > first_row ? top : first_row; row < (bottom < end_row ? bottom : end_row);
         ++row) {
      const float dy = (static_cast<float>(row) + 0.5F - rows[i]) * per_row;
      const float rest = 1.0F - dy * dy;
      float* const texels = buffer.depth + static_cast<size_t>(row) * buffer.stride;
      for (int column = left; column < right; column += kLanes) {
        const Floats dx = centers + (static_cast<float>(column) - columns[i]) * per_column;
        const Floats w = Max(rest - dx * dx, Floats{});
        const Floats before = Load(texels + column);
        weight += w;
        depth += w * before;
        Store(before + buffer.optical_depth * w, texels + column);
      }
    }
    weights[i] = Sum(weight);
    depths[i] = Sum(depth);
  }
}

void Shade(const uint32_t* order, size_t begin, size_t end, const Placed& placed,
           const float* depth, const Lens& lens, const Look& look, Sprite* sprites, Rect* rects) {
  const float radius_squared = lens.radius * lens.radius;
  for (size_t place = begin; place < end; place += kLanes) {
    // Eight at a time; the last may repeat itself.
    uint32_t which[kLanes];
    Floats x{};
    Floats y{};
    Floats z{};
    Floats met{};
    for (int lane = 0; lane < kLanes; ++lane) {
      const size_t at = place + static_cast<size_t>(lane);
      which[lane] = order[at < end ? at : end - 1];
      x[lane] = placed.x[which[lane]];
      y[lane] = placed.y[which[lane]];
      z[lane] = placed.z[which[lane]];
      met[lane] = depth[which[lane]];
    }
    const Floats light = ExpOfMinus(met * look.density);
    // The cone round the particle, in slopes and then in pixels; v grows downward.
    const Floats slope_x = x / z;
    const Floats slope_y = y / z;
    const Floats form = (z * z) / (radius_squared * lens.pixels_per_slope * lens.pixels_per_slope);
    const Floats a = form * (1.0F + slope_y * slope_y);
    const Floats b = form * slope_x * slope_y * 2.0F;
    const Floats c = form * (1.0F + slope_x * slope_x);
    // Its tangents: (x z +- r sqrt(x^2 + z^2 - r^2)) / (z^2 - r^2).
    const Floats scale = lens.pixels_per_slope / (z * z - radius_squared);
    const Floats middle_x = lens.center_x + x * z * scale;
    const Floats middle_y = lens.center_y - y * z * scale;
    const Floats reach_x = lens.radius * Sqrt(x * x + z * z - radius_squared) * scale;
    const Floats reach_y = lens.radius * Sqrt(y * y + z * z - radius_squared) * scale;
    for (int lane = 0; lane < kLanes && place + static_cast<size_t>(lane) < end; ++lane) {
      const size_t at = place + static_cast<size_t>(lane);
      sprites[at] = {lens.center_x + slope_x[lane] * lens.pixels_per_slope,
                     lens.center_y - slope_y[lane] * lens.pixels_per_slope,
                     a[lane],
                     b[lane],
                     c[lane],
                     look.dark[0] + look.lit[0] * light[lane],
                     look.dark[1] + look.lit[1] * light[lane],
                     look.dark[2] + look.lit[2] * light[lane]};
      const auto within = [](float value, int high) {
        return static_cast<int16_t>(Clamp(FirstFrom(value), 0, high));
      };
      rects[at] = {within(middle_x[lane] - reach_x[lane], lens.width),
                   within(middle_x[lane] + reach_x[lane], lens.width),
                   within(middle_y[lane] - reach_y[lane], lens.height),
                   within(middle_y[lane] + reach_y[lane], lens.height)};
    }
  }
}

void Composite(const uint32_t* entries, size_t count, const Sprite* sprites, const Opacity& opacity,
               const Lens& lens, int x, int y, float enough, float* pixels) {
  constexpr size_t kChunk = 16;  // entries between two looks at what still shines through
  const Floats columns = Centers() + static_cast<float>(x);
  const Floats rows = Centers() + static_cast<float>(y);
  Floats inverse[kTile];  // 1 / |ray|^2
  Floats through[kTile];
  Floats red[kTile] = {};
  Floats green[kTile] = {};
  Floats blue[kTile] = {};
  for (int row = 0; row < kTile; ++row) {
    const Floats slope_x = (columns - lens.center_x) / lens.pixels_per_slope;
    const float slope_y = (rows[row] - lens.center_y) / lens.pixels_per_slope;
    inverse[row] = 1.0F / (slope_x * slope_x + (slope_y * slope_y + 1.0F));
    through[row] = All(1.0F);
  }
  for (size_t begin = 0; begin < count; begin += kChunk) {
    const size_t end = begin + kChunk < count ? begin + kChunk : count;
    for (size_t e = begin; e < end; ++e) {
      const Sprite& sprite = sprites[entries[e] & ((1U << kSpriteBits) - 1U)];
      const int first = static_cast<int>(entries[e] >> kSpriteBits & 15U);
      const int last = static_cast<int>(entries[e] >> (kSpriteBits + 4));
      const Floats u = columns - sprite.x;
      const Floats v = rows - sprite.y;
      const Floats auu = sprite.a * u * u;
      const Floats bv = sprite.b * v;
      const Floats cvv = sprite.c * v * v;
      for (int row = first; row <= last; ++row) {
        const Floats form = auu + bv[row] * u + cvv[row];
        const Floats w = Max(1.0F - form * inverse[row], Floats{});
        Floats alpha = w * opacity.of_power[3] + opacity.of_power[2];
        alpha = alpha * w + opacity.of_power[1];
        alpha = alpha * w + opacity.of_power[0];
        alpha *= w;
        const Floats seen = alpha * through[row];
        through[row] -= seen;
        red[row] += sprite.red * seen;
        green[row] += sprite.green * seen;
        blue[row] += sprite.blue * seen;
      }
    }
    Floats most{};
    for (const Floats& row : through) most = Max(most, row);
    if (Largest(most) < enough) break;
  }
  const int width = lens.width - x < kTile ? lens.width - x : kTile;
  const int height = lens.height - y < kTile ? lens.height - y : kTile;
  for (int row = 0; row < height; ++row) {
    const Floats coverage = 1.0F - through[row];
    float* const out = pixels + (static_cast<size_t>(y + row) * static_cast<size_t>(lens.width) +
                                 static_cast<size_t>(x)) *
                                    4;
    for (int column = 0; column < width; ++column) {
      out[4 * column] = red[row][column];
      out[4 * column + 1] = green[row][column];
      out[4 * column + 2] = blue[row][column];
      out[4 * column + 3] = coverage[column];
    }
  }
}

}  // namespace halflight::bench::kernels
