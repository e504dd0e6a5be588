// Uploads: what is kept, what is refused, and how much memory a promise is worth.

#include "server/particle_upload.h"

#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/error_detail.h"
#include "tests/server/made_particles.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using testing::Chunk;
using testing::Describe;
using testing::Finish;
using ::testing::HasSubstr;
using testing::Header;
using testing::MakeParticles;

class Upload : public ::testing::Test {
 protected:
  // The status of the first message that fails, or of the end of the stream.
  absl::Status Send(const std::vector<v1::UploadParticlesRequest>& messages) {
    ParticleUpload upload(store_, partial_, limits_);
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
  PartialUploadOptions::Time now_{};
  PartialUploads partial_{memory_, {.now = [this] { return now_; }}};
};

TEST_F(Upload, CutAnywhereGivesTheSameSet) {
  const auto whole = BuildInlineParticles(particles_, limits_);
  ASSERT_TRUE(whole.ok());
  for (const size_t size : {1U, 3U, 7U, 1000U, 100000U}) {
    ParticleStore store(1 << 20);
    ParticleUpload upload(store, partial_, limits_);
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
  // What is no digest is not repeated, however long it is.
  other.set_sha256(std::string(1 << 20, 'x'));
  const absl::Status status = Send({Header(header_), Chunk(particles_.payload()), Finish(other)});
  EXPECT_THAT(std::string(status.message()), HasSubstr("finish.sha256: 1048576 bytes"));
  EXPECT_LT(status.message().size(), 300U);
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

TEST_F(Upload, ValueThatIsHalfAnothersIsNobodysFaultYet) {
  const std::string& bytes = particles_.payload();
  {
    ParticleUpload rubbish(store_, partial_, limits_);
    ASSERT_TRUE(rubbish.Receive(Header(header_)).ok());
    ASSERT_TRUE(rubbish.Receive(Chunk(std::string(4, '\xff'))).ok());
  }
  ASSERT_EQ(partial_.CommittedBytes(header_.sha256()), 4U);
  ParticleUpload resumed(store_, partial_, limits_);
  ASSERT_TRUE(resumed.Receive(Header(header_, 4)).ok());
  const absl::Status status = resumed.Receive(Chunk(bytes.substr(4)));
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_EQ(DetailOf(status).reason, v1::ERROR_REASON_CHECKSUM_MISMATCH);
  EXPECT_TRUE(Send({Header(header_), Chunk(bytes), Finish(header_)}).ok());
}

TEST_F(Upload, OneClientsUploadsLeaveRoomForOthers) {
  ByteBudget small(4000, 3000);
  PartialUploads partial(small, {});
  const std::string& bytes = particles_.payload();
  ParticleUpload greedy(store_, partial, limits_, {.peer = "ipv4:192.0.2.1:1000"});
  ASSERT_TRUE(greedy.Receive(Header(header_)).ok());
  ASSERT_TRUE(greedy.Receive(Chunk(bytes.substr(0, 3000))).ok());
  ParticleUpload other(store_, partial, limits_, {.peer = "ipv4:192.0.2.2:1000"});
  ASSERT_TRUE(other.Receive(Header(header_)).ok());
  ParticleUpload again(store_, partial, limits_, {.peer = "ipv4:192.0.2.1:1001"});
  ASSERT_TRUE(again.Receive(Header(header_)).ok());
  const absl::Status refused = again.Receive(Chunk(bytes.substr(0, 100)));
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(DetailOf(refused).reason, v1::ERROR_REASON_UPLOAD_MEMORY_FULL);
  EXPECT_TRUE(DetailOf(refused).retry_after.has_value());
  EXPECT_TRUE(other.Receive(Chunk(bytes.substr(0, 1000))).ok());
}

TEST_F(Upload, AllUploadsTogetherStayWithinTheirMemory) {
  ByteBudget small(4000);
  PartialUploads partial(small, {});
  const std::string& bytes = particles_.payload();
  const v1::InlineParticles others = MakeParticles(101, {v1::PARTICLE_ATTRIBUTE_POSITION});
  ParticleUpload first(store_, partial, limits_);
  ASSERT_TRUE(first.Receive(Header(header_)).ok());
  ASSERT_TRUE(first.Receive(Chunk(bytes.substr(0, 3000))).ok());
  ParticleUpload second(store_, partial, limits_);
  ASSERT_TRUE(second.Receive(Header(Describe(others))).ok());
  ASSERT_TRUE(second.Receive(Chunk(others.payload().substr(0, 900))).ok());
  const absl::Status refused = second.Receive(Chunk(others.payload().substr(900)));
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(DetailOf(refused).reason, v1::ERROR_REASON_UPLOAD_MEMORY_FULL);
  EXPECT_EQ(partial.CommittedBytes(Describe(others).sha256()), 900U) << "it is kept";
  EXPECT_EQ(small.left(), 100U);
  ASSERT_TRUE(first.Receive(Chunk(bytes.substr(3000))).ok()) << "what is kept makes room";
  EXPECT_EQ(partial.CommittedBytes(Describe(others).sha256()), 0U);
  ASSERT_TRUE(first.Receive(Finish(header_)).ok());
  EXPECT_EQ(small.left(), 4000U);
}

TEST_F(Upload, BrokenOffAnywhereItGoesOnFromThere) {
  const std::string& bytes = particles_.payload();
  for (const size_t at : {1U, 13U, 1200U, 1201U, 3199U, 3200U}) {
    ParticleStore store(1 << 20);
    {
      ParticleUpload upload(store, partial_, limits_);
      ASSERT_TRUE(upload.Receive(Header(header_)).ok());
      ASSERT_TRUE(upload.Receive(Chunk(bytes.substr(0, at))).ok());
    }
    ASSERT_EQ(partial_.CommittedBytes(header_.sha256()), at);
    ParticleUpload upload(store, partial_, limits_);
    ASSERT_TRUE(upload.Receive(Header(header_, at)).ok());
    ASSERT_TRUE(upload.Receive(Chunk(bytes.substr(at))).ok());
    ASSERT_TRUE(upload.Receive(Finish(header_)).ok()) << at;
    EXPECT_TRUE(upload.AtEndOfStream().ok());
    const auto set = store.Find(header_.sha256());
    ASSERT_NE(set, nullptr) << at;
    EXPECT_EQ(set->colors, BuildInlineParticles(particles_, limits_)->set->colors);
    EXPECT_EQ(memory_.left(), 1U << 20U);
  }
}

TEST_F(Upload, ResumedBeforeTheEndOfWhatIsKeptPassesOverWhatIsThere) {
  const std::string& bytes = particles_.payload();
  Send({Header(header_), Chunk(bytes.substr(0, 2000))}).IgnoreError();
  const absl::Status status = Send({Header(header_, 500), Chunk(bytes.substr(500, 1000)),
                                    Chunk(bytes.substr(1500)), Finish(header_)});
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_TRUE(store_.Touch(header_.sha256()));
}

TEST_F(Upload, ResumeOffsetBeyondWhatIsKeptIsRefusedAndHarmsNothing) {
  const std::string& bytes = particles_.payload();
  Send({Header(header_), Chunk(bytes.substr(0, 2000))}).IgnoreError();
  const absl::Status status = Send({Header(header_, 2001), Chunk(bytes.substr(2001))});
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(status.message(),
            "header.resume_offset: 2001, allowed: at most 2000, the bytes kept of this set");
  EXPECT_EQ(partial_.CommittedBytes(header_.sha256()), 2000U);
  EXPECT_EQ(Send({Header(header_, UINT64_MAX)}).code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(Send({Header(Describe(MakeParticles(7, {v1::PARTICLE_ATTRIBUTE_POSITION})), 1)}).code(),
            absl::StatusCode::kOutOfRange);
  EXPECT_TRUE(Send({Header(header_, 2000), Chunk(bytes.substr(2000)), Finish(header_)}).ok());
}

TEST_F(Upload, HeaderOfAnotherLayoutGetsNothingOfWhatIsKept) {
  const std::string& bytes = particles_.payload();
  Send({Header(header_), Chunk(bytes.substr(0, 2000))}).IgnoreError();
  v1::ParticleSetDescription other = header_;
  other.mutable_layout()->mutable_origin()->set_y(3.0);
  EXPECT_EQ(Send({Header(other, 2000), Chunk(bytes.substr(2000)), Finish(other)}).code(),
            absl::StatusCode::kOutOfRange);
  EXPECT_TRUE(Send({Header(header_, 2000), Chunk(bytes.substr(2000)), Finish(header_)}).ok());
}

TEST_F(Upload, ResumedUploadMustStillSendAllTheRest) {
  const std::string& bytes = particles_.payload();
  Send({Header(header_), Chunk(bytes)}).IgnoreError();
  const absl::Status status = Send({Header(header_, 100), Finish(header_)});
  EXPECT_THAT(std::string(status.message()), HasSubstr("finish: after 100 bytes"));
  EXPECT_FALSE(store_.Touch(header_.sha256()));
}

TEST_F(Upload, OtherBytesKeptUnderTheNameAreNeverCommittedAndCostOneTry) {
  std::string wrong = particles_.payload();
  wrong[100] = static_cast<char>(wrong[100] ^ 1);
  Send({Header(header_), Chunk(wrong.substr(0, 2000))}).IgnoreError();
  const std::string& bytes = particles_.payload();
  EXPECT_EQ(Send({Header(header_, 2000), Chunk(bytes.substr(2000)), Finish(header_)}).code(),
            absl::StatusCode::kDataLoss);
  EXPECT_FALSE(store_.Touch(header_.sha256()));
  EXPECT_EQ(partial_.CommittedBytes(header_.sha256()), 0U) << "a mismatch drops what was kept";
  EXPECT_EQ(memory_.left(), 1U << 20U);
  EXPECT_TRUE(Send({Header(header_), Chunk(bytes), Finish(header_)}).ok());
}

TEST_F(Upload, TwoOfOneSetAtOnceBothEndWellAndTheFirstCommits) {
  const std::string& bytes = particles_.payload();
  ParticleUpload one(store_, partial_, limits_);
  ParticleUpload two(store_, partial_, limits_);
  ParticleUpload late(store_, partial_, limits_);
  for (ParticleUpload* upload : {&one, &two, &late}) {
    ASSERT_TRUE(upload->Receive(Header(header_)).ok());
  }
  ASSERT_TRUE(one.Receive(Chunk(bytes.substr(0, 1000))).ok());
  ASSERT_TRUE(two.Receive(Chunk(bytes.substr(0, 3200))).ok());
  ASSERT_TRUE(one.Receive(Chunk(bytes.substr(1000))).ok());
  ASSERT_TRUE(one.Receive(Finish(header_)).ok());
  ASSERT_TRUE(two.Receive(Finish(header_)).ok());
  EXPECT_FALSE(two.response()->already_present());
  ASSERT_TRUE(late.Receive(Chunk(bytes.substr(0, 1))).ok());
  ASSERT_TRUE(late.response().has_value()) << "it need not send the rest";
  EXPECT_TRUE(late.response()->already_present());
  EXPECT_EQ(memory_.left(), 1U << 20U);
}

TEST_F(Upload, OneThatLiesDoesNotHarmAnotherOfTheSameName) {
  const std::string& bytes = particles_.payload();
  ParticleUpload liar(store_, partial_, limits_);
  ParticleUpload honest(store_, partial_, limits_);
  ASSERT_TRUE(liar.Receive(Header(header_)).ok());
  ASSERT_TRUE(honest.Receive(Header(header_)).ok());
  std::string wrong = bytes;
  wrong[100] = static_cast<char>(wrong[100] ^ 1);
  ASSERT_TRUE(honest.Receive(Chunk(bytes.substr(0, 50))).ok());
  ASSERT_TRUE(liar.Receive(Chunk(wrong)).ok());
  ASSERT_TRUE(honest.Receive(Chunk(bytes.substr(50))).ok());
  EXPECT_EQ(liar.Receive(Finish(header_)).code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(store_.Touch(header_.sha256()));
  EXPECT_TRUE(honest.Receive(Finish(header_)).ok());
}

TEST_F(Upload, ErrorOfTheClientKeepsNothing) {
  std::string bytes = particles_.payload();
  Send({Header(header_), Chunk(bytes), Chunk("x")}).IgnoreError();
  Send({Header(header_), Chunk(bytes.substr(0, 10)), Header(header_)}).IgnoreError();
  Send({Header(header_), Chunk(bytes.substr(0, 10)), Finish(header_)}).IgnoreError();
  EXPECT_EQ(partial_.CommittedBytes(header_.sha256()), 0U);
  EXPECT_EQ(memory_.left(), 1U << 20U);
}

// Streams of honest and of broken messages in any order, of two sets, as clients come, break off
// and come again: what is committed is right, whatever is answered, and in the end no memory is
// held.
TEST_F(Upload, AnyStreamOfMessagesCommitsTheRightBytesOrNone) {
  const v1::InlineParticles sets[] = {particles_,
                                      MakeParticles(40, {v1::PARTICLE_ATTRIBUTE_POSITION})};
  const auto large = std::make_shared<ParticleSet>();
  large->positions.resize((1 << 20) / 12);  // fills the store
  std::mt19937 random(20261);
  const auto below = [&random](size_t n) {
    return std::uniform_int_distribution<size_t>(0, n - 1)(random);
  };
  int committed = 0;
  int resumed = 0;
  for (int round = 0; round < 20000; ++round) {
    const size_t which = below(2);
    const std::string& bytes = sets[which].payload();
    v1::ParticleSetDescription header = Describe(sets[which]);
    ParticleUpload upload(store_, partial_, limits_);
    const uint64_t kept = partial_.CommittedBytes(header.sha256());
    const size_t lie = below(16);
    uint64_t at = lie == 0 ? below(4000) : below(2) * below(kept + 1);
    if (lie == 1) {
      header.set_sha256(std::string(below(40), 'y'));
    }
    bool open = upload.Receive(Header(header, at)).ok();
    resumed += open && at > 0 ? 1 : 0;
    while (open && !upload.response().has_value() && below(12) != 0) {
      std::string chunk = bytes.substr(std::min<size_t>(at, bytes.size()), below(1500));
      at += chunk.size();
      switch (below(40)) {
        case 0:
          open = upload.Receive({}).ok();
          break;
        case 1:
          open = upload.Receive(Header(header)).ok();
          break;
        case 2:
          open = upload.Receive(Finish(header)).ok();
          break;
        case 3:
          chunk += "more";
          open = upload.Receive(Chunk(chunk)).ok();
          break;
        case 4:
          if (!chunk.empty()) {
            chunk[0] = static_cast<char>(chunk[0] ^ 1);
          }
          open = upload.Receive(Chunk(chunk)).ok();
          break;
        default:
          open = upload.Receive(Chunk(chunk)).ok();
          break;
      }
      if (open && at >= bytes.size() && !upload.response().has_value()) {
        open = upload.Receive(Finish(header)).ok();
      }
    }
    const bool ended_well = upload.AtEndOfStream().ok();
    auto set = store_.Find(Describe(sets[which]).sha256());
    ASSERT_EQ(ended_well, open && upload.response().has_value()) << round;
    ASSERT_TRUE(!ended_well || set != nullptr) << round;
    if (set != nullptr) {
      ++committed;
      const auto expected = BuildInlineParticles(sets[which], limits_);
      ASSERT_EQ(set->positions, expected->set->positions) << round;
      ASSERT_EQ(set->radii, expected->set->radii) << round;
      ASSERT_EQ(set->colors, expected->set->colors) << round;
      // Out again, so that the next upload is not answered at once.
      set.reset();
      EXPECT_TRUE(store_.Insert("large", std::make_shared<ParticleSet>(*large)).ok());
    }
  }
  EXPECT_GT(committed, 500);
  EXPECT_GT(resumed, 500);
  now_ += std::chrono::hours(1);
  partial_.DropExpired();
  EXPECT_EQ(memory_.left(), 1U << 20U);
}

TEST_F(Upload, SetThatIsHeldIsAnsweredAfterTheHeader) {
  ASSERT_TRUE(Send({Header(header_), Chunk(particles_.payload()), Finish(header_)}).ok());
  ParticleUpload again(store_, partial_, limits_);
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
