// Particles to send.
#pragma once

#include <vector>

#include "halflight/v1/scene.pb.h"

namespace halflight::testing {

// Inline particles with every attribute listed; values are in range.
v1::InlineParticles MakeParticles(int count, const std::vector<v1::ParticleAttribute>& attributes);

}  // namespace halflight::testing
