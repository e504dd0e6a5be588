// What holds of all particles of a set, for checks of requests: found out by one walk over the set,
// which may be long, and kept as long as the set is.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include <glm/vec3.hpp>

#include "renderer/scene.h"
#include "server/convert/geometry.h"

namespace halflight {

// Axis by axis.
struct VectorRange {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};
};

struct ParticleBounds {
  std::optional<BoundingSphere> at_rest;  // of the centres where the set has no radii; empty: none
  VectorRange positions;                  // offsets from the set's origin
  VectorRange velocities;                 // 0 where the set has none
  float largest_radius = 0.0F;            // 0 where the set has none
};

ParticleBounds FindBounds(const ParticleSet& set);

// Holds where every particle is after a time, as offsets; wider where they do not move alike.
VectorRange PositionsAfter(const ParticleBounds& bounds, double seconds);

// A set is told from others by its object, which must not change; it is not kept alive. Any thread.
class BoundsCache {
 public:
  // Walks over the set where nobody has; who asks meanwhile waits for that.
  std::shared_ptr<const ParticleBounds> Of(const std::shared_ptr<const ParticleSet>& set);

  // A sphere round all centres after a time, radii included where the set has them; without a walk
  // where that time was asked for last.
  std::optional<BoundingSphere> After(const std::shared_ptr<const ParticleSet>& set,
                                      double seconds);

  // Sets that are remembered: those that live, and at most as many again and a few.
  [[nodiscard]] size_t size() const;

 private:
  struct Entry {
    std::once_flag once;
    ParticleBounds bounds;
    std::mutex mutex;  // of those below
    std::optional<double> seconds;
    std::optional<BoundingSphere> after;
  };

  std::shared_ptr<Entry> EntryOf(const std::shared_ptr<const ParticleSet>& set);

  mutable std::mutex mutex_;
  std::map<std::weak_ptr<const ParticleSet>, std::shared_ptr<Entry>, std::owner_less<>> entries_;
  size_t forget_at_ = 0;  // entries, when those of sets that are gone go
};

}  // namespace halflight
