// Four lanes in the compiler's vector type: two SSE2 or one AVX2 register, of equal results, since
// no fused multiply-add is used in either.
#include "renderer/reference/depth_sum.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace halflight::reference {
namespace {

constexpr size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(32)));

#define HALFLIGHT_INLINE inline __attribute__((always_inline))

HALFLIGHT_INLINE void Load(const std::vector<double>& values, size_t index, Lanes& lanes) {
  std::memcpy(&lanes, values.data() + index, sizeof(lanes));
}

// The last few elements; lanes beyond them get `otherwise`.
HALFLIGHT_INLINE void LoadPart(const std::vector<double>& values, size_t index, size_t count,
                               double otherwise, Lanes& lanes) {
  for (size_t lane = 0; lane < kLanes; ++lane) {
    lanes[lane] = lane < count ? values[index + lane] : otherwise;
  }
}

struct ParallelRay {
  glm::dvec2 place;

  static constexpr bool kHasZ = false;
  HALFLIGHT_INLINE void SquaredImpact(const Lanes& x, const Lanes& y, const Lanes& /*z*/,
                                      Lanes& squared) const {
    const Lanes dx = x - place.x;
    const Lanes dy = y - place.y;
    squared = dx * dx + dy * dy;
  }
};

struct PointRay {
  glm::dvec3 direction;

  static constexpr bool kHasZ = true;
  HALFLIGHT_INLINE void SquaredImpact(const Lanes& x, const Lanes& y, const Lanes& z,
                                      Lanes& squared) const {
    const Lanes along = x * direction.x + y * direction.y + z * direction.z;
    const Lanes dx = x - along * direction.x;
    const Lanes dy = y - along * direction.y;
    const Lanes dz = z - along * direction.z;
    squared = dx * dx + dy * dy + dz * dz;
    // As far away as can be, behind the origin.
    const Lanes infinity = Lanes{} + HUGE_VAL;
    squared = along > 0.0 ? squared : infinity;
  }
};

template <Profile kProfile, typename Ray>
HALFLIGHT_INLINE void AddLanes(const Ray& ray, const Lanes& x, const Lanes& y, const Lanes& z,
                               const Lanes& inverse_square_radius, const Lanes& optical_depth,
                               Lanes& sum) {
  const Lanes zero{};
  Lanes squared;
  ray.SquaredImpact(x, y, z, squared);
  Lanes remaining = 1.0 - squared * inverse_square_radius;
  remaining = remaining > zero ? remaining : zero;
  if constexpr (kProfile == Profile::kBall) {
    for (size_t lane = 0; lane < kLanes; ++lane) remaining[lane] = std::sqrt(remaining[lane]);
  }
  sum += optical_depth * remaining;
}

template <Profile kProfile, typename Ray>
HALFLIGHT_INLINE double Sum(const ParticleColumns& p, size_t begin, size_t end, const Ray& ray,
                            double enough) {
  constexpr size_t kBetweenChecks = 16 * kLanes;
  Lanes sum{};
  Lanes x{};
  Lanes y{};
  Lanes z{};
  Lanes inverse{};
  Lanes depth{};
  size_t i = begin;
  while (end - i >= kLanes) {
    const size_t stop = i + std::min(kBetweenChecks, (end - i) / kLanes * kLanes);
    for (; i < stop; i += kLanes) {
      Load(p.x, i, x);
      Load(p.y, i, y);
      if constexpr (Ray::kHasZ) Load(p.z, i, z);
      Load(p.inverse_square_radius, i, inverse);
      Load(p.optical_depth, i, depth);
      AddLanes<kProfile>(ray, x, y, z, inverse, depth, sum);
    }
    if ((sum[0] + sum[1]) + (sum[2] + sum[3]) > enough) {
      return (sum[0] + sum[1]) + (sum[2] + sum[3]);
    }
  }
  if (i < end) {
    const size_t count = end - i;
    LoadPart(p.x, i, count, 0.0, x);
    LoadPart(p.y, i, count, 0.0, y);
    if constexpr (Ray::kHasZ) LoadPart(p.z, i, count, 0.0, z);
    LoadPart(p.inverse_square_radius, i, count, 0.0, inverse);
    LoadPart(p.optical_depth, i, count, 0.0, depth);
    AddLanes<kProfile>(ray, x, y, z, inverse, depth, sum);
  }
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

template <typename Ray>
double SumBaseline(const ParticleColumns& p, Profile profile, size_t begin, size_t end,
                   const Ray& ray, double enough) {
  return profile == Profile::kSoft ? Sum<Profile::kSoft>(p, begin, end, ray, enough)
                                   : Sum<Profile::kBall>(p, begin, end, ray, enough);
}

#if defined(__x86_64__)
template <typename Ray>
__attribute__((target("avx2"))) double SumAvx2(const ParticleColumns& p, Profile profile,
                                               size_t begin, size_t end, const Ray& ray,
                                               double enough) {
  return profile == Profile::kSoft ? Sum<Profile::kSoft>(p, begin, end, ray, enough)
                                   : Sum<Profile::kBall>(p, begin, end, ray, enough);
}
#endif

template <typename Ray>
double SumOnThisMachine(const ParticleColumns& p, Profile profile, size_t begin, size_t end,
                        const Ray& ray, double enough) {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return SumAvx2(p, profile, begin, end, ray, enough);
#endif
  return SumBaseline(p, profile, begin, end, ray, enough);
}

}  // namespace

double SumAcross(const ParticleColumns& particles, Profile profile, size_t begin, size_t end,
                 const glm::dvec2& place, double enough) {
  return SumOnThisMachine(particles, profile, begin, end, ParallelRay{place}, enough);
}

double SumFromPoint(const ParticleColumns& particles, Profile profile, size_t begin, size_t end,
                    const glm::dvec3& direction, double enough) {
  return SumOnThisMachine(particles, profile, begin, end, PointRay{direction}, enough);
}

}  // namespace halflight::reference
