// Particles as the client holds them, and their form on the wire.
// Knows nothing of files (readers/) or of what the values look like when drawn (framing.h).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "halflight/v1/particles.pb.h"

namespace halflight::client {

// A particle cloud, one array an attribute. Every array but the positions may be empty, which means
// that the file says nothing of that attribute; otherwise it holds a value for each particle.
struct Particles {
  std::array<double, 3> origin{};  // added to every position, world units
  std::vector<float> positions;    // x, y, z: offsets of the centres from origin
  std::vector<float> radii;        // > 0, world units
  std::vector<float> opacities;    // at the centre, [0, 1]
  std::vector<float> colors;       // r, g, b: scene-linear
  std::vector<float> velocities;   // x, y, z: world units per second
  std::vector<float> emissions;    // r, g, b: scene-linear

  [[nodiscard]] size_t size() const { return positions.size() / 3; }
};

// A particle set ready to be sent, as particles.proto defines it.
struct EncodedParticles {
  v1::ParticleLayout layout;
  std::string payload;
  std::string sha256;  // the set's name: 32 bytes
};

// Empty attributes are left out of the layout. The arrays must be as long as size() asks for.
EncodedParticles EncodeParticles(const Particles& particles);

}  // namespace halflight::client
