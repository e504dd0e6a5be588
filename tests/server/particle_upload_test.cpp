// Uploads: what is kept, what is refused, and how much memory a promise is worth.

#include "server/particle_upload.h"

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "halflight/particle_payload.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using ::testing::HasSubstr;
using testing::MakeParticles;

v1::ParticleSetDescription Describe(const v1::InlineParticles& particles) {
  v1::ParticleSetDescription header;
  *header.mutable_layout() = particles.layout();
  header.set_byte_size(particles.payload().size());
  Sha256 digest = BeginParticleDigest(particles.layout());
  digest.Update(particles.payload());
  header.set_sha256(digest.Finish());
  return header;
}

v1::UploadParticlesRequest Header(const v1::ParticleSetDescription& header) {
  v1::UploadParticlesRequest request;
  *request.mutable_header() = header;
  return request;
}

v1::UploadParticlesRequest Chunk(const std::string& bytes) {
  v1::UploadParticlesRequest request;
  request.set_chunk(bytes);
  return request;
}

v1::UploadParticlesRequest Finish(const v1::ParticleSetDescription& header) {
  v1::UploadParticlesRequest request;
  request.mutable_finish()->set_byte_size(header.byte_size());
  request.mutable_finish()->set_sha256(header.sha256());
  return request;
}

class Upload : public ::testing::Test {
 protected:
  // The status of the first message that fails, or of the end of the stream.
  absl::Status Send(const std::vector<v1::UploadParticlesRequest>& messages) {
    ParticleUpload upload(store_, memory_, limits_);
    for (const auto& message : messages) {
      if (absl::Status status = upload.Receive(message); !status.ok()) {
        return status;
      }
    }
    return upload.AtEndOfStream();
  }

  const v1::InlineParticles particles_ =
      MakeParticles(100, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS,
                          v1::PARTICLE_ATTRIBUTE_OPACITY, v1::PARTICLE_ATTRIBUTE_COLOR});
  const v1::ParticleSetDescription header_ = Describe(particles_);
  ServerLimits limits_;
  ParticleStore store_{1 << 20};
  ByteBudget memory_{1 << 20};
};

TEST_F(Upload, CutAnywhereGivesTheSameSet) {
  const auto whole = BuildInlineParticles(particles_, limits_);
  ASSERT_TRUE(whole.ok());
  for (const size_t size : {1U, 3U, 7U, 1000U, 100000U}) {
    ParticleStore store(1 << 20);
    ParticleUpload upload(store, memory_, limits_);
    ASSERT_TRUE(upload.Receive(Header(header_)).ok());
    for (size_t at = 0; at < particles_.payload().size(); at += size) {
      ASSERT_TRUE(upload.Receive(Chunk(particles_.payload().substr(at, size))).ok());
    }
    ASSERT_TRUE(upload.Receive(Finish(header_)).ok()) << size;
    EXPECT_TRUE(upload.AtEndOfStream().ok());
    const auto set = store.Find(header_.sha256());
    ASSERT_NE(set, nullptr) << size;
    EXPECT_EQ(set->positions, whole->set->positions);
    EXPECT_EQ(set->radii, whole->set->radii);
    EXPECT_EQ(set->opacities, whole->set->opacities);
    EXPECT_EQ(set->colors, whole->set->colors);
  }
}

TEST_F(Upload, KeepsNothingWithoutFinish) {
  const absl::Status status = Send({Header(header_), Chunk(particles_.payload())});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("before finish"));
  EXPECT_EQ(store_.Find(header_.sha256()), nullptr);
}

TEST_F(Upload, RefusesMessagesOutOfOrder) {
  EXPECT_THAT(std::string(Send({}).message()), HasSubstr("before finish"));
  EXPECT_THAT(std::string(Send({Chunk("abc")}).message()), HasSubstr("no header yet"));
  EXPECT_THAT(std::string(Send({Finish(header_)}).message()), HasSubstr("no header yet"));
  EXPECT_THAT(std::string(Send({Header(header_), Header(header_)}).message()),
              HasSubstr("second header"));
  EXPECT_THAT(std::string(Send({Header(header_), {}}).message()), HasSubstr("part: unset"));
  EXPECT_THAT(std::string(Send({Header(header_), Chunk(particles_.payload()), Finish(header_),
                                Chunk("more")})
                              .message()),
              HasSubstr("after finish"));
}

TEST_F(Upload, RefusesFewerAndMoreBytesThanPromised) {
  std::string bytes = particles_.payload();
  const absl::Status more = Send({Header(header_), Chunk(bytes), Chunk("x")});
  EXPECT_EQ(more.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(more.message()), HasSubstr("3201 bytes or more, allowed: 3200 bytes"));
  bytes.pop_back();
  const absl::Status fewer = Send({Header(header_), Chunk(bytes), Finish(header_)});
  EXPECT_EQ(fewer.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(fewer.message()), HasSubstr("finish: after 3199 bytes"));
  EXPECT_EQ(store_.bytes(), 0U);
}

TEST_F(Upload, RefusesABodyThatDoesNotHaveThePromisedName) {
  v1::ParticleSetDescription header = header_;
  header.mutable_sha256()->back() ^= 1;
  const absl::Status status = Send({Header(header), Chunk(particles_.payload()), Finish(header)});
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(store_.bytes(), 0U);
}

TEST_F(Upload, NameCoversTheOriginToo) {
  v1::ParticleSetDescription header = header_;
  header.mutable_layout()->mutable_origin()->set_x(1.0);
  const absl::Status status = Send({Header(header), Chunk(particles_.payload()), Finish(header)});
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
}

TEST_F(Upload, RefusesAHeaderThatContradictsItself) {
  v1::ParticleSetDescription header = header_;
  header.set_byte_size(header.byte_size() + 4);
  EXPECT_THAT(std::string(Send({Header(header)}).message()),
              HasSubstr("header.byte_size: 3204, allowed: 3200"));
  header = header_;
  header.set_sha256("short");
  EXPECT_THAT(std::string(Send({Header(header)}).message()), HasSubstr("header.sha256: 5 bytes"));
  header = header_;
  header.mutable_layout()->add_attributes(v1::PARTICLE_ATTRIBUTE_POSITION);
  EXPECT_THAT(std::string(Send({Header(header)}).message()),
              HasSubstr("header.layout.attributes[4]: PARTICLE_ATTRIBUTE_POSITION"));
}

TEST_F(Upload, RefusesAFinishThatContradictsTheHeader) {
  v1::ParticleSetDescription other = header_;
  other.set_byte_size(1);
  EXPECT_THAT(
      std::string(Send({Header(header_), Chunk(particles_.payload()), Finish(other)}).message()),
      HasSubstr("finish.byte_size: 1"));
  other = header_;
  other.set_sha256(std::string(32, 'x'));
  EXPECT_THAT(
      std::string(Send({Header(header_), Chunk(particles_.payload()), Finish(other)}).message()),
      HasSubstr("finish.sha256: 7878"));
}

TEST_F(Upload, BadValueIsRefusedAsSoonAsItArrives) {
  std::string bytes = particles_.payload();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(bytes.data() + (7 * 3 + 2) * sizeof(float), &nan, sizeof(nan));
  // Only the first hundred bytes are sent.
  const absl::Status status = Send({Header(header_), Chunk(bytes.substr(0, 100))});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "position[7].z: nan, allowed: [-1e+17, 1e+17]");
}

TEST_F(Upload, HugePromiseWithASmallBodyTakesLittleMemory) {
  v1::ParticleLayout layout;
  layout.add_attributes(v1::PARTICLE_ATTRIBUTE_POSITION);
  layout.set_count(50'000'000);
  const auto bytes = CheckedPayloadBytes(layout, "layout", limits_);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  ParticleAssembler assembler(layout, *bytes);
  ASSERT_TRUE(assembler.Append(std::string(1000, '\0')).ok());
  EXPECT_LE(assembler.capacity_bytes(), 4096U);
}

TEST_F(Upload, CountOverTheLimitsIsRefusedBeforeAnyBody) {
  v1::ParticleSetDescription header = header_;
  header.mutable_layout()->set_count(UINT64_MAX);
  const absl::Status status = Send({Header(header)});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("header.layout.count: 18446744073709551615"));
  limits_.max_particle_bytes = 3199;
  EXPECT_EQ(Send({Header(header_)}).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(Upload, AllUploadsTogetherStayWithinTheirMemory) {
  ByteBudget small(4000);
  ParticleUpload first(store_, small, limits_);
  ASSERT_TRUE(first.Receive(Header(header_)).ok());
  ASSERT_TRUE(first.Receive(Chunk(particles_.payload().substr(0, 3000))).ok());
  {
    ParticleUpload second(store_, small, limits_);
    ASSERT_TRUE(second.Receive(Header(header_)).ok());
    ASSERT_TRUE(second.Receive(Chunk(particles_.payload().substr(0, 800))).ok());
    EXPECT_EQ(second.Receive(Chunk(particles_.payload().substr(800))).code(),
              absl::StatusCode::kResourceExhausted);
  }
  EXPECT_EQ(small.left(), 1000U) << "what the second held was not given back";
  ASSERT_TRUE(first.Receive(Chunk(particles_.payload().substr(3000))).ok());
  ASSERT_TRUE(first.Receive(Finish(header_)).ok());
  EXPECT_EQ(small.left(), 4000U);
}

TEST_F(Upload, SetThatIsHeldIsAnsweredAfterTheHeader) {
  ASSERT_TRUE(Send({Header(header_), Chunk(particles_.payload()), Finish(header_)}).ok());
  ParticleUpload again(store_, memory_, limits_);
  ASSERT_TRUE(again.Receive(Header(header_)).ok());
  ASSERT_TRUE(again.response().has_value());
  EXPECT_TRUE(again.response()->already_present());
}

TEST_F(Upload, EmptySetIsCommitted) {
  const auto empty = MakeParticles(0, {v1::PARTICLE_ATTRIBUTE_POSITION});
  const auto header = Describe(empty);
  EXPECT_TRUE(Send({Header(header), Finish(header)}).ok());
  EXPECT_NE(store_.Find(header.sha256()), nullptr);
}

}  // namespace
}  // namespace halflight
