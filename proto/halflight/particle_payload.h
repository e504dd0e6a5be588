// The bytes of a particle set as particles.proto defines them: which arrays, how many bytes, and
// the name of the set. Shared by client and server; of what the values mean it knows only how large
// a length may be.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "halflight/sha256.h"
#include "halflight/v1/particles.pb.h"

namespace halflight {

struct AttributeFormat {
  v1::ParticleAttribute attribute;
  const char* name;  // as in messages: "position"
  uint32_t floats;   // a particle
};

// In the order of the payload.
inline constexpr std::array<AttributeFormat, 6> kAttributeFormats = {{
    {v1::PARTICLE_ATTRIBUTE_POSITION, "position", 3},
    {v1::PARTICLE_ATTRIBUTE_RADIUS, "radius", 1},
    {v1::PARTICLE_ATTRIBUTE_OPACITY, "opacity", 1},
    {v1::PARTICLE_ATTRIBUTE_COLOR, "color", 3},
    {v1::PARTICLE_ATTRIBUTE_VELOCITY, "velocity", 3},
    {v1::PARTICLE_ATTRIBUTE_EMISSION, "emission", 3},
}};

// Lengths between which 32-bit floats can hold the squares and inverse squares that rendering
// needs, with room for the distances round them.
inline constexpr double kLargestLength = 1e17;
inline constexpr double kSmallestRadius = 1e-15;

bool HasAttribute(const v1::ParticleLayout& layout, v1::ParticleAttribute attribute);

// Bytes of payload that the layout asks for; none where the product overflows 63 bits.
std::optional<uint64_t> PayloadBytes(const v1::ParticleLayout& layout);

// What a set's name covers before the payload, as particles.proto defines it.
inline constexpr size_t kParticlePrefixBytes = 40;
std::string ParticlePrefix(const v1::ParticleLayout& layout);
// The layout that has this prefix, its attributes in ascending order; none where the bytes are no
// prefix. Values are as they come.
std::optional<v1::ParticleLayout> ParseParticlePrefix(std::string_view prefix);

// A digest that has seen the layout's 40-byte prefix: update it with the payload and finish it to
// get the set's name.
Sha256 BeginParticleDigest(const v1::ParticleLayout& layout);

}  // namespace halflight
