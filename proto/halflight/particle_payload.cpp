#include "halflight/particle_payload.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string_view>

namespace halflight {

static_assert(std::endian::native == std::endian::little,
              "payloads and digests are little-endian and copied as they lie in memory");

namespace {

constexpr std::string_view kMagic = "HLP1";

template <typename T>
void Append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// The first bytes as a value, and removed.
template <typename T>
T Take(std::string_view& bytes) {
  T value;
  std::memcpy(&value, bytes.data(), sizeof(value));
  bytes.remove_prefix(sizeof(value));
  return value;
}

}  // namespace

bool HasAttribute(const v1::ParticleLayout& layout, v1::ParticleAttribute attribute) {
  return std::find(layout.attributes().begin(), layout.attributes().end(), attribute) !=
         layout.attributes().end();
}

std::optional<uint64_t> PayloadBytes(const v1::ParticleLayout& layout) {
  uint64_t bytes_per_particle = 0;
  for (const AttributeFormat& format : kAttributeFormats) {
    if (HasAttribute(layout, format.attribute)) {
      bytes_per_particle += format.floats * sizeof(float);
    }
  }
  constexpr uint64_t kMax = INT64_MAX;
  if (bytes_per_particle != 0 && layout.count() > kMax / bytes_per_particle) {
    return std::nullopt;
  }
  return layout.count() * bytes_per_particle;
}

std::string ParticlePrefix(const v1::ParticleLayout& layout) {
  uint32_t attribute_bits = 0;
  for (const int attribute : layout.attributes()) {
    attribute_bits |= 1U << (static_cast<uint32_t>(attribute) & 31U);
  }
  std::string prefix(kMagic);
  Append(prefix, attribute_bits);
  Append(prefix, static_cast<uint64_t>(layout.count()));
  Append(prefix, layout.origin().x());
  Append(prefix, layout.origin().y());
  Append(prefix, layout.origin().z());
  return prefix;
}

std::optional<v1::ParticleLayout> ParseParticlePrefix(std::string_view prefix) {
  if (prefix.size() != kParticlePrefixBytes || prefix.substr(0, kMagic.size()) != kMagic) {
    return std::nullopt;
  }
  prefix.remove_prefix(kMagic.size());
  auto attribute_bits = Take<uint32_t>(prefix);
  v1::ParticleLayout layout;
  for (const AttributeFormat& format : kAttributeFormats) {
    const uint32_t bit = 1U << static_cast<uint32_t>(format.attribute);
    if ((attribute_bits & bit) != 0) {
      layout.add_attributes(format.attribute);
      attribute_bits -= bit;
    }
  }
  if (attribute_bits != 0) {
    return std::nullopt;
  }
  layout.set_count(Take<uint64_t>(prefix));
  layout.mutable_origin()->set_x(Take<double>(prefix));
  layout.mutable_origin()->set_y(Take<double>(prefix));
  layout.mutable_origin()->set_z(Take<double>(prefix));
  return layout;
}

Sha256 BeginParticleDigest(const v1::ParticleLayout& layout) {
  Sha256 sha;
  sha.Update(ParticlePrefix(layout));
  return sha;
}

}  // namespace halflight
