#include "halflight/particle_payload.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace halflight {

static_assert(std::endian::native == std::endian::little,
              "payloads and digests are little-endian and copied as they lie in memory");

namespace {

template <typename T>
void Append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
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

Sha256 BeginParticleDigest(const v1::ParticleLayout& layout) {
  uint32_t attribute_bits = 0;
  for (const int attribute : layout.attributes()) {
    attribute_bits |= 1U << (static_cast<uint32_t>(attribute) & 31U);
  }
  std::string prefix = "HLP1";
  Append(prefix, attribute_bits);
  Append(prefix, static_cast<uint64_t>(layout.count()));
  Append(prefix, layout.origin().x());
  Append(prefix, layout.origin().y());
  Append(prefix, layout.origin().z());
  Sha256 sha;
  sha.Update(prefix);
  return sha;
}

}  // namespace halflight
