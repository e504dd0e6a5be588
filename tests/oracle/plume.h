// The test plume's particles, read from its PLY files.
// No general PLY reader: only the properties and the encoding that these files have.
#pragma once

#include <memory>
#include <string>

#include "renderer/scene.h"

namespace halflight::oracle {

// Positions and velocities, with the origin at zero; null where the file cannot be read, or is of
// another make.
std::shared_ptr<ParticleSet> LoadPlume(const std::string& path);

}  // namespace halflight::oracle
