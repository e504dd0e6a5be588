// The kernels' bodies. Included by one file for each instruction set, in a namespace of its own.
// Light: optical depth is added texel by texel in the order of the light; what a particle meets
// there before its own is deposited goes into its moments. Eye: front to back "over" of Porter and
// Duff 1984, in chunks that are summed on their own, so that a million thin layers add up.

namespace halflight::sweep::HALFLIGHT_KERNEL_SET {
namespace {

using namespace simd;  // NOLINT(google-build-using-namespace): every line below is made of it

HALFLIGHT_INLINE Floats WeightAt(const Floats& rho_squared, bool ball) {
  const Floats w = Max(1.0F - rho_squared, Floats{});
  return ball ? Sqrt(w) : w;
}

HALFLIGHT_INLINE Floats LaneCenters() {
  return Floats{0.5F, 1.5F, 2.5F, 3.5F, 4.5F, 5.5F, 6.5F, 7.5F};
}

template <bool kOrthographic, int kDegree>
void SweepLightTile(const LightTileJob& job) {
  constexpr int kTerms = Terms(kDegree);
  const Floats lanes = LaneCenters();
  for (uint32_t e = 0; e < job.entry_count; ++e) {
    const LightEntry& entry = job.entries[e];
    const Sprite sprite = job.sprites[entry.sprite];
    Floats sums[2 * kTerms] = {};
    for (int row = entry.y_begin; row < entry.y_end; ++row) {
      const float py = job.grid.first_y + (static_cast<float>(row) + 0.5F) * job.grid.step_y;
      const float sy = (py - sprite.y) * sprite.scale;
      float* const row_depth = job.depth + row * kLightTile;
      Floats weights[kDegree + 1] = {};  // times x^a
      Floats depths[kDegree + 1] = {};
      for (int column = entry.x_begin & ~(kLanes - 1); column < entry.x_end; column += kLanes) {
        const Floats px = job.grid.first_x + (lanes + static_cast<float>(column)) * job.grid.step_x;
        const Floats sx = (px - sprite.x) * sprite.scale;
        Floats rho_squared = sx * sx + sy * sy;
        if (!kOrthographic) {
          const Floats turn = sprite.x * sy - sprite.y * sx;
          rho_squared = (rho_squared + turn * turn) / (px * px + (py * py + 1.0F));
        }
        Floats w = WeightAt(rho_squared, job.shape.ball);
        const Floats before = Load(row_depth + column);
        Store(before + sprite.optical_depth * w, row_depth + column);
        for (int a = 0; a <= kDegree; ++a) {
          weights[a] += w;
          depths[a] += w * before;
          w *= sx;
        }
      }
      float power = 1.0F;
      for (int b = 0; b <= kDegree; ++b) {
        for (int a = 0, term = b; a <= kDegree - b; term += kDegree + 1 - a, ++a) {
          sums[term] += weights[a] * power;
          sums[kTerms + term] += depths[a] * power;
        }
        power *= sy;
      }
    }
    float* const moments = job.moments + static_cast<size_t>(entry.moments) * (2 * kTerms);
    for (int i = 0; i < 2 * kTerms; ++i) moments[i] = Sum(sums[i]);
  }
}

template <int kDegree>
HALFLIGHT_INLINE Floats Evaluate(const float* polynomial, const Floats& x, const Floats& y) {
  Floats value{};
  const float* of_power = polynomial + Terms(kDegree);
  for (int a = kDegree; a >= 0; --a) {
    of_power -= kDegree - a + 1;
    Floats row = All(of_power[kDegree - a]);
    for (int b = kDegree - a - 1; b >= 0; --b) row = row * y + of_power[b];
    value = value * x + row;
  }
  return value;
}

// The same where y is one number for all lanes.
template <int kDegree>
HALFLIGHT_INLINE Floats EvaluateRow(const float* polynomial, const Floats& x, float y) {
  float rows[kDegree + 1];  // coefficients of x^a
  for (int a = 0; a <= kDegree; ++a) {
    float row = polynomial[kDegree - a];
    for (int b = kDegree - a - 1; b >= 0; --b) row = row * y + polynomial[b];
    rows[a] = row;
    polynomial += kDegree - a + 1;
  }
  Floats value = All(rows[kDegree]);
  for (int a = kDegree - 1; a >= 0; --a) value = value * x + rows[a];
  return value;
}

struct Pixels {
  Floats red{};
  Floats green{};
  Floats blue{};
  Floats coverage{};
};

// What is composited beside the image.
struct Extras {
  float* depth;
  float* transmittance;
};

constexpr int kPlane = kImageTile * kImageTile;

HALFLIGHT_INLINE void AddTo(float* plane, const Floats& more) { Store(Load(plane) + more, plane); }

// One particle over one row. `Exponent(light, channel)` gives a light's exponent.
template <bool kColored, typename Exponent>
HALFLIGHT_INLINE void CompositeRow(const ShadedSprites& shaded, uint32_t i, const Floats& alpha,
                                   const Exponent& exponent, const Floats& depth, int row,
                                   const Extras& extras, Pixels& chunk) {
  const Rgb unshadowed = shaded.unshadowed[i];
  const Rgb* const lit = shaded.lit + static_cast<size_t>(i) * shaded.lights;
  Floats red = All(unshadowed.red);
  Floats green = All(unshadowed.green);
  Floats blue = All(unshadowed.blue);
  const Floats seen = alpha - alpha * chunk.coverage;
  const auto exp_of = [&](int light, int channel) {
    const Floats x = exponent(light, channel);
    return ExpOfMinus(shaded.shadow_alone[light] ? Max(x, Floats{}) : x);
  };
  for (int light = 0; light < shaded.lights; ++light) {
    const Floats t = exp_of(light, 0);
    const Floats t_green = kColored ? exp_of(light, 1) : t;
    const Floats t_blue = kColored ? exp_of(light, 2) : t;
    red += lit[light].red * t;
    green += lit[light].green * t_green;
    blue += lit[light].blue * t_blue;
    if (extras.transmittance != nullptr) {
      float* const planes = extras.transmittance + light * 3 * kPlane + row * kImageTile;
      AddTo(planes, t * seen);
      AddTo(planes + kPlane, t_green * seen);
      AddTo(planes + 2 * kPlane, t_blue * seen);
    }
  }
  if (extras.depth != nullptr) AddTo(extras.depth + row * kImageTile, depth * seen);
  chunk.red += red * seen;
  chunk.green += green * seen;
  chunk.blue += blue * seen;
  chunk.coverage += seen;
}

// The rows of a tile and their pixels.
struct TileRays {
  Floats px;
  float py[kImageTile];
  Floats inverse_length[kImageTile];  // 1 / |ray|^2
};

HALFLIGHT_INLINE TileRays RaysOf(const PixelGrid& grid) {
  TileRays rays;
  rays.px = grid.first_x + LaneCenters() * grid.step_x;
  for (int row = 0; row < kImageTile; ++row) {
    rays.py[row] = grid.first_y + (static_cast<float>(row) + 0.5F) * grid.step_y;
    rays.inverse_length[row] = 1.0F / (rays.px * rays.px + (rays.py[row] * rays.py[row] + 1.0F));
  }
  return rays;
}

struct RowRange {
  int begin;
  int end;
};

HALFLIGHT_INLINE RowRange RowsOf(const ImageTileJob& job, uint32_t i) {
  const int begin = job.shaded.rows[2 * i] - job.first_row;
  const int end = job.shaded.rows[2 * i + 1] - job.first_row;
  return {begin > 0 ? begin : 0, end < kImageTile ? end : kImageTile};
}

// A sprite in scaled coordinates.
template <bool kOrthographic, bool kColored, int kDegree>
HALFLIGHT_INLINE void CompositeSprite(const ImageTileJob& job, uint32_t i, const TileRays& rays,
                                      const Extras& extras, Pixels* chunk) {
  constexpr int kTerms = Terms(kDegree);
  constexpr int kExponents = kColored ? 3 : 1;
  const ShadedSprites& shaded = job.shaded;
  const Sprite sprite = shaded.sprites[i];
  const float* const exponents =
      shaded.exponent + static_cast<size_t>(i) * shaded.lights * (kExponents * kTerms);
  const RowRange rows = RowsOf(job, i);
  const Floats x = (rays.px - sprite.x) * sprite.scale;
  for (int row = rows.begin; row < rows.end; ++row) {
    const float y = (rays.py[row] - sprite.y) * sprite.scale;
    Floats rho_squared = x * x + y * y;
    if (!kOrthographic) {
      const Floats turn = sprite.x * y - sprite.y * x;
      rho_squared = (rho_squared + turn * turn) * rays.inverse_length[row];
    }
    const Floats alpha = OpacityOf(sprite.optical_depth * WeightAt(rho_squared, job.shape.ball));
    Floats depth{};
    if (extras.depth != nullptr) {
      const float* const d = shaded.depth + 3 * static_cast<size_t>(i);
      depth = d[0] + d[1] * y + d[2] * x;
    }
    CompositeRow<kColored>(
        shaded, i, alpha,
        [&](int light, int channel) {
          return EvaluateRow<kDegree>(exponents + (light * kExponents + channel) * kTerms, x, y);
        },
        depth, row, extras, chunk[row]);
  }
}

// A sprite near the eye: the general encounter of shaders/splat.glsl.
template <bool kColored, int kDegree>
[[gnu::noinline]] void CompositeNearSprite(const ImageTileJob& job, uint32_t i,
                                           const TileRays& rays, const Extras& extras,
                                           Pixels* chunk) {
  constexpr int kTerms = Terms(kDegree);
  constexpr int kExponents = kColored ? 3 : 1;
  const ShadedSprites& shaded = job.shaded;
  const float* const c = shaded.near[i].center;
  const NearLight* const lights = shaded.near_lights + static_cast<size_t>(i) * shaded.lights;
  const float* const exponents =
      shaded.exponent + static_cast<size_t>(i) * shaded.lights * (kExponents * kTerms);
  const RowRange rows = RowsOf(job, i);
  for (int row = rows.begin; row < rows.end; ++row) {
    const Floats px = rays.px;
    const float py = rays.py[row];
    // cross(center, ray) with the ray (px, py, -1), and cross(that, ray) / |ray|^2.
    const Floats mx = All(-c[1] - c[2] * py);
    const Floats my = c[2] * px + c[0];
    const Floats mz = c[0] * py - c[1] * px;
    const Floats inverse = rays.inverse_length[row];
    const Floats rho_squared = (mx * mx + my * my + mz * mz) * inverse;
    const Floats ox = (-my - mz * py) * inverse;
    const Floats oy = (mz * px + mx) * inverse;
    const Floats oz = (mx * py - my * px) * inverse;
    const Floats along = c[0] * px + (c[1] * py - c[2]);
    Floats alpha =
        OpacityOf(shaded.sprites[i].optical_depth * WeightAt(rho_squared, job.shape.ball));
    alpha = along > 0.0F ? alpha : Floats{};
    Floats depth{};
    if (extras.depth != nullptr) {
      const float* const d = shaded.depth + 3 * static_cast<size_t>(i);
      depth = d[0] - d[1] * oz;
    }
    CompositeRow<kColored>(
        shaded, i, alpha,
        [&](int light, int channel) {
          const NearLight& axes = lights[light];
          return Evaluate<kDegree>(exponents + (light * kExponents + channel) * kTerms,
                                   axes.x[0] * ox + axes.x[1] * oy + axes.x[2] * oz,
                                   axes.y[0] * ox + axes.y[1] * oy + axes.y[2] * oz);
        },
        depth, row, extras, chunk[row]);
  }
}

HALFLIGHT_INLINE float Least(const Floats& x) {
  float least = x[0];
  for (int lane = 1; lane < kLanes; ++lane) least = x[lane] < least ? x[lane] : least;
  return least;
}

// Adds a chunk's extras behind what is there already, and clears them for the next.
HALFLIGHT_INLINE void FoldPlanes(const Pixels* total, float* chunk, float* sum, int planes) {
  for (int plane = 0; plane < planes; ++plane) {
    for (int row = 0; row < kImageTile; ++row) {
      const int at = plane * kPlane + row * kImageTile;
      AddTo(sum + at, (1.0F - total[row].coverage) * Load(chunk + at));
      Store(Floats{}, chunk + at);
    }
  }
}

template <bool kOrthographic, bool kColored, int kDegree>
void CompositeImageTile(const ImageTileJob& job) {
  // Front to back, so many particles at a time: their own sum first, then behind what lies nearer.
  constexpr uint32_t kChunk = 32;
  const TileRays rays = RaysOf(job.grid);
  Pixels total[kImageTile];
  float depth_chunk[kPlane] = {};
  float transmittance_chunk[kMaxTileLights * 3 * kPlane];
  const Extras extras = {job.depth != nullptr ? depth_chunk : nullptr,
                         job.transmittance != nullptr ? transmittance_chunk : nullptr};
  if (extras.transmittance != nullptr) {
    for (int i = 0; i < job.shaded.lights * 3 * kPlane; ++i) transmittance_chunk[i] = 0.0F;
  }
  for (uint32_t begin = 0; begin < job.entry_count; begin += kChunk) {
    const uint32_t end = begin + kChunk < job.entry_count ? begin + kChunk : job.entry_count;
    Pixels chunk[kImageTile];
    for (uint32_t e = begin; e < end; ++e) {
      const uint32_t i = job.entries[e];
      if (!kOrthographic && job.shaded.sprites[i].scale == 0.0F) {
        CompositeNearSprite<kColored, kDegree>(job, i, rays, extras, chunk);
      } else {
        CompositeSprite<kOrthographic, kColored, kDegree>(job, i, rays, extras, chunk);
      }
    }
    if (extras.depth != nullptr) FoldPlanes(total, extras.depth, job.depth, 1);
    if (extras.transmittance != nullptr) {
      FoldPlanes(total, extras.transmittance, job.transmittance, 3 * job.shaded.lights);
    }
    Floats least = All(2.0F);
    for (int row = 0; row < kImageTile; ++row) {
      const Floats clear = 1.0F - total[row].coverage;
      total[row].red += clear * chunk[row].red;
      total[row].green += clear * chunk[row].green;
      total[row].blue += clear * chunk[row].blue;
      total[row].coverage += clear * chunk[row].coverage;
      least = Min(least, total[row].coverage);
    }
    if (1.0F - Least(least) < job.least_transmittance) break;
  }
  for (int row = 0; row < kImageTile; ++row) {
    float* const out = job.pixels + row * kImageTile;
    Store(total[row].red, out);
    Store(total[row].green, out + kPlane);
    Store(total[row].blue, out + 2 * kPlane);
    Store(total[row].coverage, out + 3 * kPlane);
  }
}

template <int kDegree>
void SweepAtDegree(const LightTileJob& job) {
  job.shape.orthographic ? SweepLightTile<true, kDegree>(job) : SweepLightTile<false, kDegree>(job);
}

template <int kDegree>
void CompositeAtDegree(const ImageTileJob& job) {
  if (job.shaded.exponents == 3) {
    job.shape.orthographic ? CompositeImageTile<true, true, kDegree>(job)
                           : CompositeImageTile<false, true, kDegree>(job);
  } else {
    job.shape.orthographic ? CompositeImageTile<true, false, kDegree>(job)
                           : CompositeImageTile<false, false, kDegree>(job);
  }
}

void Sweep(const LightTileJob& job) {
  constexpr void (*kByDegree[])(const LightTileJob&) = {
      SweepAtDegree<0>, SweepAtDegree<1>, SweepAtDegree<2>, SweepAtDegree<3>,
      SweepAtDegree<4>, SweepAtDegree<5>, SweepAtDegree<6>};
  kByDegree[job.degree](job);
}

void CompositeTile(const ImageTileJob& job) {
  constexpr void (*kByDegree[])(const ImageTileJob&) = {
      CompositeAtDegree<0>, CompositeAtDegree<1>, CompositeAtDegree<2>, CompositeAtDegree<3>,
      CompositeAtDegree<4>, CompositeAtDegree<5>, CompositeAtDegree<6>};
  kByDegree[job.shaded.degree](job);
}

}  // namespace

extern const Kernels kKernels = {Sweep, CompositeTile};

}  // namespace halflight::sweep::HALFLIGHT_KERNEL_SET
