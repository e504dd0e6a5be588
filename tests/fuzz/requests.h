// What the targets that take requests share: servers of several kinds, and particles on them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "renderer/frame_engine.h"
#include "server/limits.h"
#include "server/particle_store.h"

namespace halflight::fuzz {

struct Server {
  ServerLimits limits;
  DeviceInfo device;
};

// Which of several, by the input's first byte: on a CPU or a GPU, with the usual limits or with
// such as a test would set.
const Server& ServerOf(uint8_t choice);

// Holds a few sets, always the same: with all attributes and with positions alone, of some
// particles and of none.
ParticleStore& StoreWithSets();
// Their names.
const std::vector<std::string>& NamesOfSets();

}  // namespace halflight::fuzz
