#include "tests/server/made_particles.h"

#include "halflight/particle_payload.h"

namespace halflight::testing {

v1::InlineParticles MakeParticles(int count, const std::vector<v1::ParticleAttribute>& attributes) {
  v1::InlineParticles particles;
  particles.mutable_layout()->set_count(count);
  for (const v1::ParticleAttribute attribute : attributes) {
    particles.mutable_layout()->add_attributes(attribute);
  }
  std::vector<float> values;
  for (const AttributeFormat& format : kAttributeFormats) {
    if (HasAttribute(particles.layout(), format.attribute)) {
      for (uint32_t k = 0; k < count * format.floats; ++k) {
        values.push_back(1.0F / static_cast<float>(k + 1));
      }
    }
  }
  particles.set_payload(
      std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)));
  return particles;
}

}  // namespace halflight::testing
