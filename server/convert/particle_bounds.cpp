#include "server/convert/particle_bounds.h"

#include <algorithm>
#include <vector>

#include <glm/common.hpp>

namespace halflight {
namespace {

// Sets that are gone may be remembered beside those that live, so that looking for them stays rare.
constexpr size_t kFewGone = 16;

VectorRange RangeOf(const std::vector<glm::vec3>& values) {
  if (values.empty()) {
    return {};
  }
  glm::vec3 low = values.front();
  glm::vec3 high = low;
  for (const glm::vec3& value : values) {
    low = glm::min(low, value);
    high = glm::max(high, value);
  }
  return {low, high};
}

}  // namespace

ParticleBounds FindBounds(const ParticleSet& set) {
  const auto largest = std::max_element(set.radii.begin(), set.radii.end());
  return {.at_rest = Bounds(set, 0.0F, 0.0),
          .positions = RangeOf(set.positions),
          .velocities = RangeOf(set.velocities),
          .largest_radius = largest != set.radii.end() ? *largest : 0.0F};
}

VectorRange PositionsAfter(const ParticleBounds& bounds, double seconds) {
  const glm::dvec3 one = seconds * bounds.velocities.low;
  const glm::dvec3 other = seconds * bounds.velocities.high;
  return {bounds.positions.low + glm::min(one, other),
          bounds.positions.high + glm::max(one, other)};
}

std::shared_ptr<const ParticleBounds> BoundsCache::Of(
    const std::shared_ptr<const ParticleSet>& set) {
  const std::shared_ptr<Entry> entry = EntryOf(set);
  std::call_once(entry->once, [&] { entry->bounds = FindBounds(*set); });
  return {entry, &entry->bounds};
}

std::optional<BoundingSphere> BoundsCache::After(const std::shared_ptr<const ParticleSet>& set,
                                                 double seconds) {
  const std::shared_ptr<Entry> entry = EntryOf(set);
  const std::lock_guard lock(entry->mutex);
  if (entry->seconds != seconds) {
    entry->after = Bounds(*set, 0.0F, seconds);
    entry->seconds = seconds;
  }
  return entry->after;
}

size_t BoundsCache::size() const {
  const std::lock_guard lock(mutex_);
  return entries_.size();
}

std::shared_ptr<BoundsCache::Entry> BoundsCache::EntryOf(
    const std::shared_ptr<const ParticleSet>& set) {
  const std::lock_guard lock(mutex_);
  if (const auto found = entries_.find(set); found != entries_.end()) {
    return found->second;
  }
  if (entries_.size() >= forget_at_) {
    std::erase_if(entries_, [](const auto& entry) { return entry.first.expired(); });
    forget_at_ = 2 * entries_.size() + kFewGone;
  }
  return entries_.emplace(set, std::make_shared<Entry>()).first->second;
}

}  // namespace halflight
