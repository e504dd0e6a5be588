// Uploads by many at once, for the sanitizers to look at: stores, budget and what is kept are
// shared.
#include <atomic>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/particle_upload.h"
#include "server/worker_pool.h"
#include "tests/server/made_particles.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using testing::Chunk;
using testing::Describe;
using testing::Finish;
using testing::Header;
using testing::MakeParticles;

constexpr int kThreads = 4;
constexpr int kSets = 3;
constexpr int kRounds = 200;

// One stream: goes on from what is kept, sends some chunks, and breaks off now and then.
bool Upload(const v1::InlineParticles& particles, int round, ParticleStore& store,
            PartialUploads& partial, const ServerLimits& limits) {
  const v1::ParticleSetDescription header = Describe(particles);
  const std::string& payload = particles.payload();
  ParticleUpload upload(store, partial, limits);
  uint64_t at = partial.CommittedBytes(header.sha256());
  if (!upload.Receive(Header(header, at)).ok()) {
    return false;  // somebody else went on from there
  }
  constexpr size_t kChunk = 100;
  for (int chunks = 0; at < payload.size(); at += kChunk, ++chunks) {
    if (upload.response().has_value()) {
      return true;
    }
    if ((round % 3 == 0 && chunks == 2) ||
        !upload.Receive(Chunk(payload.substr(at, kChunk))).ok()) {
      return false;
    }
  }
  return upload.response().has_value() || upload.Receive(Finish(header)).ok();
}

TEST(UploadThreads, ShareStoreMemoryAndWhatIsKept) {
  std::vector<v1::InlineParticles> sets;
  for (int i = 0; i < kSets; ++i) {
    sets.push_back(
        MakeParticles(30 + i, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS}));
  }
  const ServerLimits limits;
  ByteBudget memory(1200);  // of two sets and a half
  PartialUploads partial(memory, {.max_count = 2});
  ParticleStore store(1100);  // of two sets
  std::atomic<int> complete = 0;
  {
    WorkerPool pool(kThreads);
    for (int round = 0; round < kRounds; ++round) {
      pool.Post([&, round] {
        complete +=
            Upload(sets[static_cast<size_t>(round % kSets)], round, store, partial, limits) ? 1 : 0;
      });
      if (round % 10 == 0) {
        pool.Post([&] { partial.DropExpired(); });
      }
    }
  }
  EXPECT_GT(complete, 0);
  EXPECT_LE(store.bytes(), 1100U);
  for (const v1::InlineParticles& set : sets) {
    partial.Drop(Describe(set).sha256());
  }
  EXPECT_EQ(memory.left(), 1200U);
}

}  // namespace
}  // namespace halflight
