// The same cloud in more or fewer particles, to see what their number costs.
// Leaves out velocities, and attributes of single particles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "renderer/scene.h"

namespace halflight::measure {

// `count` particles at the places of `source`: every so-manieth of them where there are more,
// copies of each where there are fewer. The first copy stands where its original does, the others
// are moved by up to `jitter` (world units), evenly in a ball. `opacity` becomes what keeps the sum
// of all optical depths. The same arguments give the same set, on every machine. `source` is not
// empty and has positions alone; `opacity` is that of each, below 1.
struct Replica {
  std::shared_ptr<const ParticleSet> particles;
  float opacity;
};
Replica Replicate(const ParticleSet& source, size_t count, float opacity, float jitter,
                  uint32_t seed = 1);

}  // namespace halflight::measure
