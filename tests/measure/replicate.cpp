#include "tests/measure/replicate.h"

#include <cmath>
#include <random>

#include <glm/geometric.hpp>

namespace halflight::measure {

Replica Replicate(const ParticleSet& source, size_t count, float opacity, float jitter,
                  uint32_t seed) {
  std::mt19937 random(seed);
  // std::uniform_real_distribution may differ between libraries; this does not.
  const auto signed_unit = [&] { return static_cast<float>(random()) * 0x1p-31F - 1.0F; };
  const auto in_ball = [&] {
    glm::vec3 point(1.0F);
    while (glm::dot(point, point) > 1.0F) {
      point.x = signed_unit();
      point.y = signed_unit();
      point.z = signed_unit();
    }
    return point;
  };
  auto set = std::make_shared<ParticleSet>();
  set->origin = source.origin;
  set->positions.reserve(count);
  size_t previous = source.size();
  for (size_t i = 0; i < count; ++i) {
    const size_t original = i * source.size() / count;
    const glm::vec3& position = source.positions[original];
    set->positions.push_back(original == previous ? position + jitter * in_ball() : position);
    previous = original;
  }
  const double optical_depth = -std::log1p(-static_cast<double>(opacity)) *
                               static_cast<double>(source.size()) / static_cast<double>(count);
  return {std::move(set), static_cast<float>(-std::expm1(-optical_depth))};
}

}  // namespace halflight::measure
