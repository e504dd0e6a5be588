// The form of particles on the wire, against digests that Python's struct and hashlib computed.
#include "client/particles.h"

#include <gtest/gtest.h>

#include "halflight/particle_payload.h"

namespace halflight::client {
namespace {

TEST(EncodeParticles, NamesASetByPrefixAndPayload) {
  Particles particles;
  particles.origin = {1e7, 0, -3};
  particles.positions = {1, 2, 3, 4, 5, 6};
  particles.radii = {0.5F, 0.25F};
  const EncodedParticles encoded = EncodeParticles(particles);
  EXPECT_EQ(encoded.layout.count(), 2U);
  EXPECT_EQ(encoded.layout.attributes_size(), 2);
  EXPECT_EQ(encoded.payload.size(), *PayloadBytes(encoded.layout));
  EXPECT_EQ(ToHex(encoded.sha256),
            "a5c4ead67f1bb4498d5453da760863d563ac660fde809e1571813e963192523f");
}

TEST(EncodeParticles, PutsAttributesInTheOrderOfTheirNumbers) {
  Particles particles;
  particles.positions = {0, 0, 0};
  particles.opacities = {0.5F};
  particles.colors = {1, 0.5F, 0.25F};
  particles.velocities = {7, 8, 9};
  particles.emissions = {0, 0, 2};
  EXPECT_EQ(ToHex(EncodeParticles(particles).sha256),
            "e6260847a8621fc21a4eb225249baefaa09586f2e8d5aee7d759b1ad7ab6cb5d");
}

TEST(EncodeParticles, NamesTheEmptySetToo) {
  EXPECT_EQ(ToHex(EncodeParticles(Particles()).sha256),
            "f0c53478d807ceb8c3acb9ac5bbc0e905f97bd702b011fd238fc779ddfaef31a");
}

TEST(EncodeParticles, TellsSetsApartByTheirOriginAlone) {
  Particles particles;
  particles.positions = {1, 2, 3};
  const std::string at_zero = EncodeParticles(particles).sha256;
  particles.origin = {0, 0, 1};
  EXPECT_NE(EncodeParticles(particles).sha256, at_zero);
}

}  // namespace
}  // namespace halflight::client
