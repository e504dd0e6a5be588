// Where a particle store has a set.
#pragma once

#include <string>

#include "server/particle_store.h"

namespace halflight::testing {

// On disk, and not in memory.
inline bool OnDiskAlone(ParticleStore& store, const std::string& sha256) {
  return store.Use(sha256) == nullptr && store.Touch(sha256);
}

}  // namespace halflight::testing
