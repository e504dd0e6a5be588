#include "client/particles.h"

#include "halflight/particle_payload.h"

namespace halflight::client {

namespace {

const std::vector<float>& ArrayOf(const Particles& particles, v1::ParticleAttribute attribute) {
  switch (attribute) {
    case v1::PARTICLE_ATTRIBUTE_RADIUS:
      return particles.radii;
    case v1::PARTICLE_ATTRIBUTE_OPACITY:
      return particles.opacities;
    case v1::PARTICLE_ATTRIBUTE_COLOR:
      return particles.colors;
    case v1::PARTICLE_ATTRIBUTE_VELOCITY:
      return particles.velocities;
    case v1::PARTICLE_ATTRIBUTE_EMISSION:
      return particles.emissions;
    default:
      return particles.positions;
  }
}

}  // namespace

EncodedParticles EncodeParticles(const Particles& particles) {
  EncodedParticles encoded;
  v1::ParticleLayout& layout = encoded.layout;
  layout.set_count(particles.size());
  for (const AttributeFormat& format : kAttributeFormats) {
    if (format.attribute == v1::PARTICLE_ATTRIBUTE_POSITION ||
        !ArrayOf(particles, format.attribute).empty()) {
      layout.add_attributes(format.attribute);
    }
  }
  layout.mutable_origin()->set_x(particles.origin[0]);
  layout.mutable_origin()->set_y(particles.origin[1]);
  layout.mutable_origin()->set_z(particles.origin[2]);

  // The payload is the arrays as they lie in memory: particle_payload.cpp asserts little-endian.
  encoded.payload.reserve(PayloadBytes(layout).value_or(0));
  for (const AttributeFormat& format : kAttributeFormats) {
    const std::vector<float>& array = ArrayOf(particles, format.attribute);
    encoded.payload.append(reinterpret_cast<const char*>(array.data()),
                           array.size() * sizeof(float));
  }
  Sha256 sha = BeginParticleDigest(layout);
  sha.Update(encoded.payload);
  encoded.sha256 = sha.Finish();
  return encoded;
}

}  // namespace halflight::client
