#include "renderer/sweep/sprites.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "renderer/parallel.h"
#include "renderer/sort.h"

#if defined(__x86_64__)
#define HALFLIGHT_AVX2 [[gnu::target("avx2")]]
#else
#define HALFLIGHT_AVX2
#endif
#define HALFLIGHT_INLINE [[gnu::always_inline]] inline

namespace halflight::sweep {

namespace {

// TangentSlopes of a disc that reaches both w > 0, of which alone it tells, and w <= 0, where a
// tangent bounds nothing. The tangents' directions are the centre's, turned by the angle whose sine
// is as r and whose cosine as their length.
glm::dvec2 VisibleSlopes(double x, double w, double r) {
  constexpr double kInfinity = 1e30;
  const double tangent_squared = x * x + (w - r) * (w + r);
  if (tangent_squared <= 0.0) return {-kInfinity, kInfinity};
  const double tangent = std::sqrt(tangent_squared);
  const glm::dvec2 low(x * tangent - w * r, w * tangent + x * r);
  const glm::dvec2 high(x * tangent + w * r, w * tangent - x * r);
  return {low.y > 0.0 ? low.x / low.y : -kInfinity, high.y > 0.0 ? high.x / high.y : kInfinity};
}

Rect RectOf(const Projection& target, const glm::dvec2& xs, const glm::dvec2& ys) {
  const glm::dvec2 a = glm::dvec2(xs.x, ys.y) * target.pixel_from_plane + target.pixel_offset;
  const glm::dvec2 b = glm::dvec2(xs.y, ys.x) * target.pixel_from_plane + target.pixel_offset;
  // Pixels whose centres may be inside, with a little more against rounding.
  const glm::dvec2 size(target.size);
  const glm::dvec2 low = glm::clamp(glm::floor(a - 0.501) + 1.0, glm::dvec2(0.0), size);
  const glm::dvec2 high = glm::clamp(glm::floor(b - 0.499) + 1.0, glm::dvec2(0.0), size);
  if (!(low.x < high.x && low.y < high.y)) return {};
  return {static_cast<uint16_t>(low.x), static_cast<uint16_t>(high.x), static_cast<uint16_t>(low.y),
          static_cast<uint16_t>(high.y)};
}

// Four at a time. Steps and their order are those of the scalar arithmetic beside, and of
// shaders/list_sprites.comp, so that all of them come to the same; this file is compiled without
// contraction to fused operations.
constexpr int kLanes = 4;
using Doubles = double __attribute__((vector_size(kLanes * sizeof(double))));
using Words = int32_t __attribute__((vector_size(kLanes * sizeof(int32_t))));

HALFLIGHT_INLINE Doubles Max(const Doubles& a, const Doubles& b) { return a > b ? a : b; }
HALFLIGHT_INLINE Doubles Min(const Doubles& a, const Doubles& b) { return a < b ? a : b; }
HALFLIGHT_INLINE Doubles Sqrt(const Doubles& x) {
  Doubles root{};
  for (int lane = 0; lane < kLanes; ++lane) root[lane] = std::sqrt(x[lane]);
  return root;
}

struct Range {
  Doubles low;
  Doubles high;
};

// As in projection.h.
HALFLIGHT_INLINE Range TangentSlopesOf(const Doubles& x, const Doubles& w, const Doubles& r) {
  const Doubles beside = (w - r) * (w + r);
  const Doubles reach = r * Sqrt(x * x + beside);
  const Doubles middle = x * w;
  return {(middle - reach) / beside, (middle + reach) / beside};
}

// floor(x) + 1, between 0 and `size`.
HALFLIGHT_INLINE Words NextWhole(const Doubles& x, double size) {
  const Doubles within = Min(Max(x, Doubles{} - 1.0), Doubles{} + (size - 1.0));
  const Words truncated = __builtin_convertvector(within, Words);
  const Doubles back = __builtin_convertvector(truncated, Doubles);
  return truncated + 1 + __builtin_convertvector(within < back, Words);
}

// What all particles have in common.
struct Source {
  const ParticleView& particles;
  const Projection& target;
  double near_depth;
  glm::dmat3 rotation;
  glm::dvec3 origin_from_eye;
};

// Four particles in view axes, from the eye.
struct Seen {
  Doubles x;
  Doubles y;
  Doubles z;
  Doubles own_radius;
  Doubles radius;  // particles smaller than a light buffer can show are enlarged
};

// `index(lane)` says which particles.
template <bool kOrthographic, typename Index>
HALFLIGHT_INLINE Seen See(const Source& source, const Index& index) {
  const ParticleView& particles = source.particles;
  const glm::vec3* const positions = particles.positions().data();
  Doubles px{};
  Doubles py{};
  Doubles pz{};
  Seen seen{};
  for (int lane = 0; lane < kLanes; ++lane) {
    const size_t i = index(lane);
    px[lane] = positions[i].x;
    py[lane] = positions[i].y;
    pz[lane] = positions[i].z;
    seen.own_radius[lane] = particles.radius(i);
  }
  px += source.origin_from_eye.x;
  py += source.origin_from_eye.y;
  pz += source.origin_from_eye.z;
  const glm::dmat3& m = source.rotation;
  seen.x = m[0][0] * px + m[1][0] * py + m[2][0] * pz;
  seen.y = m[0][1] * px + m[1][1] * py + m[2][1] * pz;
  seen.z = m[0][2] * px + m[1][2] * py + m[2][2] * pz;
  const Doubles one = Doubles{} + 1.0;
  const Doubles least =
      source.target.least_radius * (kOrthographic ? one : Max(-seen.z, Doubles{}));
  seen.radius = Max(seen.own_radius, least);
  return seen;
}

// Sort keys of the particles in a range; whether any of them is near.
template <bool kOrthographic>
HALFLIGHT_INLINE bool MakeKeys(const Source& source, const WorkRange& range,
                               Block<uint32_t>& keys) {
  Doubles nearest = Doubles{} - 1.0;  // how far within the near depth
  for (size_t first = range.begin; first < range.end; first += kLanes) {
    // The last ones may repeat themselves.
    const size_t last = std::min<size_t>(first + kLanes, range.end) - 1;
    const Seen seen =
        See<kOrthographic>(source, [&](int lane) { return std::min(first + lane, last); });
    const Doubles key =
        kOrthographic ? -seen.z : seen.x * seen.x + seen.y * seen.y + seen.z * seen.z;
    for (size_t i = first; i <= last; ++i) {
      keys[i] = OrderedKey(static_cast<float>(key[i - first]));
    }
    nearest = Max(nearest, source.near_depth * seen.radius + seen.z);
  }
  bool any_near = false;
  for (int lane = 0; lane < kLanes; ++lane) any_near |= nearest[lane] >= 0.0;
  return any_near;
}

// A particle of a perspective target that is near, or not in front of it.
void ProjectNear(const Source& source, const Seen& seen, int lane, float optical_depth,
                 size_t place, SpriteList& list) {
  const Projection& target = source.target;
  const glm::dvec3 view(seen.x[lane], seen.y[lane], seen.z[lane]);
  const double w = -view.z;
  const double radius = seen.radius[lane];
  list.sprites[place] = {};
  list.rects[place] = {};
  if (w <= -radius) return;
  list.sprites[place].optical_depth = optical_depth;
  const glm::dvec3 center = view / radius;
  list.near[place] = {
      {static_cast<float>(center.x), static_cast<float>(center.y), static_cast<float>(center.z)}};
  list.rects[place] =
      w > kLeastNearDepth * radius
          ? RectOf(target, TangentSlopes(view.x, w, radius), TangentSlopes(view.y, w, radius))
          : RectOf(target, VisibleSlopes(view.x, w, radius), VisibleSlopes(view.y, w, radius));
}

// The particles at a range of places.
template <bool kOrthographic>
HALFLIGHT_INLINE void ProjectPlaces(const Source& source, const WorkRange& range,
                                    SpriteList& list) {
  constexpr size_t kAhead = 32;  // of what lies in no order in memory
  const Projection& target = source.target;
  const glm::dvec2& scale = target.pixel_from_plane;
  const glm::dvec2& offset = target.pixel_offset;
  const glm::vec3* const positions = source.particles.positions().data();
  const std::vector<uint32_t>& order = list.particles;
  const Doubles one = Doubles{} + 1.0;
  for (size_t first = range.begin; first < range.end; first += kLanes) {
    const size_t last = std::min<size_t>(first + kLanes, range.end) - 1;
    if (first + kAhead + kLanes <= range.end) {
      for (size_t lane = 0; lane < kLanes; ++lane) {
        __builtin_prefetch(positions + order[first + kAhead + lane]);
      }
    }
    const auto index = [&](int lane) { return order[std::min(first + lane, last)]; };
    const Seen seen = See<kOrthographic>(source, index);
    const auto& [x, y, z, own_radius, radius] = seen;
    const Doubles w = -z;
    // Enlarged particles keep their integral.
    const Doubles shrink = own_radius / radius;
    Doubles depth{};
    for (int lane = 0; lane < kLanes; ++lane) {
      depth[lane] = source.particles.optical_depth(index(lane));
    }
    const Doubles optical_depth = depth * (shrink * shrink);

    const Doubles sprite_x = kOrthographic ? x : x / w;
    const Doubles sprite_y = kOrthographic ? y : y / w;
    const Doubles sprite_scale = (kOrthographic ? one : w) / radius;
    const Range xs = kOrthographic ? Range{x - radius, x + radius} : TangentSlopesOf(x, w, radius);
    const Range ys = kOrthographic ? Range{y - radius, y + radius} : TangentSlopesOf(y, w, radius);
    // As RectOf: y of the plane and of pixels run against each other.
    const Words x_begin = NextWhole(xs.low * scale.x + offset.x - 0.501, target.size.x);
    const Words x_end = NextWhole(xs.high * scale.x + offset.x - 0.499, target.size.x);
    const Words y_begin = NextWhole(ys.high * scale.y + offset.y - 0.501, target.size.y);
    const Words y_end = NextWhole(ys.low * scale.y + offset.y - 0.499, target.size.y);
    const Words shown = (x_begin < x_end) & (y_begin < y_end);
    const auto in_front = kOrthographic ? w > Doubles{} : w > source.near_depth * radius;
    for (size_t place = first; place <= last; ++place) {
      const auto lane = static_cast<int>(place - first);
      const auto lane_depth = static_cast<float>(optical_depth[lane]);
      if (in_front[lane] == 0) {
        list.sprites[place] = {};
        list.rects[place] = {};
        if (!kOrthographic) ProjectNear(source, seen, lane, lane_depth, place, list);
        continue;
      }
      list.sprites[place] = {static_cast<float>(sprite_x[lane]), static_cast<float>(sprite_y[lane]),
                             static_cast<float>(sprite_scale[lane]), lane_depth};
      list.rects[place] =
          shown[lane] == 0
              ? Rect{}
              : Rect{static_cast<uint16_t>(x_begin[lane]), static_cast<uint16_t>(x_end[lane]),
                     static_cast<uint16_t>(y_begin[lane]), static_cast<uint16_t>(y_end[lane])};
    }
  }
}

// The same for each instruction set.
HALFLIGHT_INLINE bool MakeKeysOf(const Source& source, const WorkRange& range,
                                 Block<uint32_t>& keys) {
  return source.target.orthographic ? MakeKeys<true>(source, range, keys)
                                    : MakeKeys<false>(source, range, keys);
}
HALFLIGHT_INLINE void ProjectPlacesOf(const Source& source, const WorkRange& range,
                                      SpriteList& list) {
  source.target.orthographic ? ProjectPlaces<true>(source, range, list)
                             : ProjectPlaces<false>(source, range, list);
}
HALFLIGHT_AVX2 bool MakeKeysByAvx2(const Source& source, const WorkRange& range,
                                   Block<uint32_t>& keys) {
  return MakeKeysOf(source, range, keys);
}
HALFLIGHT_AVX2 void ProjectPlacesByAvx2(const Source& source, const WorkRange& range,
                                        SpriteList& list) {
  ProjectPlacesOf(source, range, list);
}

bool HasAvx2() {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2");
  return avx2;
#else
  return false;
#endif
}

}  // namespace

SpriteList ListSprites(const ParticleView& particles, const Projection& target, double near_depth) {
  const size_t count = particles.size();
  const Source source{particles, target, std::max(near_depth, kLeastNearDepth),
                      glm::dmat3(target.view_from_world), particles.set().origin - target.eye()};

  // Sort by depth.
  Block<uint32_t> keys(count);
  std::atomic<bool> has_near = false;
  ParallelRanges(count, [&](const WorkRange& range) {
    const bool any =
        HasAvx2() ? MakeKeysByAvx2(source, range, keys) : MakeKeysOf(source, range, keys);
    if (any) has_near = true;
  });
  SpriteList list;
  list.particles = SortedOrder(keys);

  // Project.
  list.sprites.resize(count);
  list.rects.resize(count);
  if (has_near && !target.orthographic) list.near.resize(count);
  ParallelRanges(count, [&](const WorkRange& range) {
    HasAvx2() ? ProjectPlacesByAvx2(source, range, list) : ProjectPlacesOf(source, range, list);
  });
  return list;
}

PixelGrid GridFrom(const Projection& target, int x, int y) {
  const glm::dvec2 step = 1.0 / target.pixel_from_plane;
  const glm::dvec2 first = (glm::dvec2(x, y) - target.pixel_offset) * step;
  return {static_cast<float>(first.x), static_cast<float>(first.y), static_cast<float>(step.x),
          static_cast<float>(step.y)};
}

}  // namespace halflight::sweep
