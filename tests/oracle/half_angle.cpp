// The definitions of half-angle slicing written down once more; see half_angle.h.
#include "tests/oracle/half_angle.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/geometric.hpp>

namespace halflight::oracle {
namespace {

// The number of particles in each slice, by how many particles come before its end.
std::vector<uint64_t> EndsByCount(uint64_t particles, uint64_t slices) {
  std::vector<uint64_t> ends;
  for (uint64_t s = 0; s < slices; ++s) ends.push_back((s + 1) * particles / slices);
  return ends;
}

// As above; a particle belongs where the middle of its weight lies in the running total.
std::vector<uint64_t> EndsByOpticalDepth(const reference::Cloud& cloud,
                                         const std::vector<uint32_t>& order, uint64_t slices) {
  const auto weight = [&](uint32_t index) {
    const reference::Particle& particle = cloud.particles[index];
    return particle.optical_depth * particle.radius * particle.radius;
  };
  double total = 0.0;
  for (const uint32_t index : order) total += weight(index);
  std::vector<uint64_t> ends(slices, 0);
  double running = 0.0;
  for (const uint32_t index : order) {
    running += weight(index);
    const double middle = running - weight(index) / 2.0;
    const double place =
        total > 0.0 ? std::floor(static_cast<double>(slices) * (middle / total)) : 0.0;
    ++ends[static_cast<size_t>(std::clamp(place, 0.0, static_cast<double>(slices - 1)))];
  }
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  return ends;
}

}  // namespace

HalfAngleOrder OrderByHalfAngle(const reference::Cloud& cloud, const reference::Rays& light,
                                const glm::dvec3& view, const ShadowSettings& settings) {
  const glm::dvec3 travel = light.DirectionAt(cloud.bounds_center);
  const bool same_way = glm::dot(view, travel) > 0.0;
  HalfAngleOrder result{.axis = glm::normalize(same_way ? view + travel : travel - view),
                        .back_to_front = !same_way,
                        .order = {},
                        .places = {}};

  std::vector<float> keys;
  for (const reference::Particle& particle : cloud.particles) {
    keys.push_back(
        static_cast<float>(glm::dot(particle.center - cloud.bounds_center, result.axis)));
  }
  result.order.resize(keys.size());
  std::iota(result.order.begin(), result.order.end(), 0U);
  std::stable_sort(result.order.begin(), result.order.end(),
                   [&keys](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });

  const auto slices = static_cast<uint64_t>(settings.slices);
  const std::vector<uint64_t> ends =
      settings.spacing == SliceSpacing::kEqualCount || slices >= keys.size()
          ? EndsByCount(keys.size(), slices)
          : EndsByOpticalDepth(cloud, result.order, slices);
  uint64_t begin = 0;
  for (const uint64_t end : ends) {
    for (uint64_t rank = begin; rank < end; ++rank) {
      const uint64_t others = end - begin - 1;
      const double fraction =
          others > 0 ? static_cast<double>(rank - begin) / static_cast<double>(others) : 0.0;
      result.places.push_back({static_cast<uint32_t>(begin), static_cast<uint32_t>(end), fraction});
    }
    begin = end;
  }
  return result;
}

}  // namespace halflight::oracle
