// Uploads that broke off: which are kept, for how long, and what makes room for what.

#include "server/partial_uploads.h"

#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "tests/server/made_particles.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using Growth = ByteBudget::Growth;
using std::chrono::seconds;
using testing::Describe;
using testing::MakeParticles;

class Partial : public ::testing::Test {
 protected:
  static v1::InlineParticles SetOf(int particles) {
    return MakeParticles(particles, {v1::PARTICLE_ATTRIBUTE_POSITION});
  }
  static std::string NameOf(int particles) { return Describe(SetOf(particles)).sha256(); }

  // An upload of the set of so many particles that got so far, and took its memory.
  std::unique_ptr<PartialUpload> Begun(int particles, uint64_t bytes,
                                       const std::string& tenant = "") {
    const v1::InlineParticles set = SetOf(particles);
    auto upload = std::make_unique<PartialUpload>(Describe(set), memory_, Caller{tenant});
    EXPECT_EQ(upload->memory.Grow(bytes), Growth::kDone);
    EXPECT_TRUE(upload->assembler.Append(set.payload().substr(0, bytes)).ok());
    return upload;
  }

  PartialUploadOptions Options() {
    return {.max_count = 3, .max_age = seconds(10), .now = [this] { return now_; }};
  }

  PartialUploadOptions::Time now_{seconds(1000)};
  ByteBudget memory_{10000};
  PartialUploads uploads_{memory_, Options()};
};

TEST_F(Partial, IsEachTenantsOwn) {
  uploads_.Keep(Begun(100, 500, "a"));
  uploads_.Keep(Begun(100, 700, "b"));
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100), "a"), 500U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100), "b"), 700U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 0U);
  v1::ParticleSetDescription header = Describe(SetOf(100));
  header.set_resume_offset(500);
  EXPECT_EQ(uploads_.Take(header).status().code(), absl::StatusCode::kOutOfRange);
  const auto taken = uploads_.Take(header, "a");
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_EQ((*taken)->assembler.received_bytes(), 500U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100), "b"), 700U);
  uploads_.Drop(NameOf(100));
  EXPECT_EQ(uploads_.count(), 0U) << "once it is complete, nobody's is kept";
}

TEST_F(Partial, MemoryIsGivenBackWhenTheTimeIsUp) {
  uploads_.Keep(Begun(100, 1000));
  now_ += seconds(5);
  uploads_.Keep(Begun(101, 500));
  now_ += seconds(5) - std::chrono::nanoseconds(1);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 1000U);
  now_ += std::chrono::nanoseconds(1);
  uploads_.DropExpired();
  EXPECT_EQ(memory_.left(), 9500U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 0U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(101)), 500U);
  now_ += seconds(5);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(101)), 0U) << "asking looks at ages too";
  EXPECT_EQ(memory_.left(), 10000U);
}

TEST_F(Partial, TooManyDropTheOneThatBrokeOffFirst) {
  for (int particles : {100, 101, 102, 103}) {
    uploads_.Keep(Begun(particles, 12));
  }
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 0U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(101)), 12U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(103)), 12U);
  EXPECT_EQ(memory_.left(), 10000U - 3 * 12);
}

TEST_F(Partial, ManyOfOneClientPushOutNobodyElses) {
  uploads_.Keep(Begun(100, 500, "other"));
  for (int particles : {101, 102, 103, 104}) {
    uploads_.Keep(Begun(particles, 12, "greedy"));
  }
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100), "other"), 500U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(102), "greedy"), 0U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(103), "greedy"), 12U);
  EXPECT_EQ(uploads_.count(), 3U);
}

TEST_F(Partial, OfTwoOfOneNameTheLongerStays) {
  uploads_.Keep(Begun(100, 500));
  uploads_.Keep(Begun(100, 300));
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 500U);
  uploads_.Keep(Begun(100, 700));
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 700U);
  EXPECT_EQ(memory_.left(), 9300U);
}

TEST_F(Partial, OneUploadTakesWhatIsKeptAndAnotherGetsNone) {
  uploads_.Keep(Begun(100, 500));
  v1::ParticleSetDescription header = Describe(SetOf(100));
  header.set_resume_offset(500);
  auto taken = uploads_.Take(header);
  ASSERT_TRUE(taken.ok());
  EXPECT_EQ((*taken)->assembler.received_bytes(), 500U);
  EXPECT_EQ(uploads_.Take(header).status().code(), absl::StatusCode::kOutOfRange);
  uploads_.Keep(*std::move(taken));
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 500U);
}

TEST_F(Partial, WhatIsKeptMakesRoomForWhatIsUnderWay) {
  uploads_.Keep(Begun(200, 2000));
  uploads_.Keep(Begun(300, 3000));
  ByteBudget::Share under_way(memory_);
  ASSERT_EQ(uploads_.Grow(under_way, 5000), Growth::kDone);
  EXPECT_EQ(memory_.left(), 0U);
  ASSERT_EQ(uploads_.Grow(under_way, 1), Growth::kDone);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(200)), 0U);
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(300)), 3000U);
  EXPECT_EQ(uploads_.Grow(under_way, 5000), Growth::kFull) << "more than there is";
  ASSERT_EQ(uploads_.Grow(under_way, 4999), Growth::kDone);
  EXPECT_EQ(memory_.left(), 0U);
}

TEST_F(Partial, ClientWithTooMuchTakesNobodyElsesRoom) {
  ByteBudget memory(10000, 4000);
  PartialUploads uploads(memory, Options());
  const auto keep = [&](int particles, uint64_t bytes, const std::string& tenant) {
    auto upload =
        std::make_unique<PartialUpload>(Describe(SetOf(particles)), memory, Caller{tenant});
    ASSERT_EQ(uploads.Grow(upload->memory, bytes), Growth::kDone);
    ASSERT_TRUE(upload->assembler.Append(SetOf(particles).payload().substr(0, bytes)).ok());
    uploads.Keep(std::move(upload));
  };
  keep(300, 3000, "other");
  keep(250, 3000, "another");
  keep(200, 2000, "greedy");
  ByteBudget::Share under_way(memory, Caller{"greedy"}.client());
  ASSERT_EQ(uploads.Grow(under_way, 2000), Growth::kDone);
  ASSERT_EQ(memory.left(), 0U);
  EXPECT_EQ(uploads.Grow(under_way, 2001), Growth::kClientFull);
  EXPECT_EQ(uploads.CommittedBytes(NameOf(200), "greedy"), 0U) << "its own gives way";
  EXPECT_EQ(uploads.CommittedBytes(NameOf(300), "other"), 3000U);
  ASSERT_EQ(uploads.Grow(under_way, 2000), Growth::kDone);
  EXPECT_EQ(memory.left(), 0U);
}

TEST_F(Partial, WhatIsTakenOverCountsAsItsNewOwners) {
  ByteBudget memory(7000, 4000);
  ByteBudget::Share share(memory, "first");
  ASSERT_EQ(share.Grow(3000), Growth::kDone);
  share.PassTo("second");
  ByteBudget::Share firsts(memory, "first");
  ByteBudget::Share others(memory, "second");
  EXPECT_EQ(firsts.Grow(4000), Growth::kDone);
  EXPECT_EQ(others.Grow(1001), Growth::kClientFull);
  share.PassTo("first");
  EXPECT_EQ(share.client(), "second") << "there is no room";
  EXPECT_EQ(memory.used(), 7000U);
}

TEST_F(Partial, NothingIsKeptOfNothingOrWhereNothingIsToBeKept) {
  uploads_.Keep(Begun(100, 0));
  EXPECT_EQ(uploads_.CommittedBytes(NameOf(100)), 0U);
  for (const PartialUploadOptions& none :
       {PartialUploadOptions{.max_count = 0}, PartialUploadOptions{.max_age = seconds(0)}}) {
    PartialUploads uploads(memory_, none);
    uploads.Keep(Begun(100, 100));
    EXPECT_EQ(uploads.CommittedBytes(NameOf(100)), 0U);
    EXPECT_EQ(memory_.left(), 10000U);
  }
}

TEST_F(Partial, ManyThreadsAtOnceLoseNoMemory) {
  {
    PartialUploads uploads(memory_, {.max_count = 2});
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&] {
        for (int i = 0; i < 300; ++i) {
          v1::ParticleSetDescription header = Describe(SetOf(10 + i % 3));
          header.set_resume_offset(uploads.CommittedBytes(header.sha256()));
          auto upload = std::make_unique<PartialUpload>(header, memory_);
          if (header.resume_offset() > 0) {
            if (auto taken = uploads.Take(header); taken.ok()) {
              upload = *std::move(taken);
            }
          }
          if (upload->assembler.received_bytes() + 12 <= header.byte_size() &&
              uploads.Grow(upload->memory, 12) == Growth::kDone) {
            ASSERT_TRUE(upload->assembler.Append(std::string(12, '\0')).ok());
          }
          if (i % 7 == 0) {
            uploads.Drop(header.sha256());
          }
          uploads.Keep(std::move(upload));
        }
      });
    }
  }
  EXPECT_EQ(memory_.left(), 10000U);
}

}  // namespace
}  // namespace halflight
