// What the particle store keeps and what it lets go.

#include "server/particle_store.h"

#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/error_detail.h"

namespace halflight {
namespace {

std::shared_ptr<const ParticleSet> SetOf(size_t particles) {
  auto set = std::make_shared<ParticleSet>();
  set->positions.resize(particles);  // 12 bytes each
  return set;
}

TEST(ParticleStore, DropsTheLeastRecentlyUsedFirst) {
  ParticleStore store(3 * 120);
  EXPECT_TRUE(store.Insert("a", SetOf(10)).ok());
  EXPECT_TRUE(store.Insert("b", SetOf(10)).ok());
  EXPECT_TRUE(store.Insert("c", SetOf(10)).ok());
  EXPECT_NE(store.Find("a"), nullptr);
  EXPECT_TRUE(store.Insert("d", SetOf(10)).ok());
  EXPECT_EQ(store.Find("b"), nullptr);
  EXPECT_NE(store.Find("a"), nullptr);
  EXPECT_NE(store.Find("c"), nullptr);
  EXPECT_NE(store.Find("d"), nullptr);
}

TEST(ParticleStore, AskingWhetherASetIsThereCountsAsUse) {
  ParticleStore store(2 * 120);
  EXPECT_TRUE(store.Insert("a", SetOf(10)).ok());
  EXPECT_TRUE(store.Insert("b", SetOf(10)).ok());
  EXPECT_TRUE(store.Touch("a"));
  EXPECT_TRUE(store.Insert("c", SetOf(10)).ok());
  EXPECT_TRUE(store.Touch("a"));
  EXPECT_FALSE(store.Touch("b"));
}

TEST(ParticleStore, NeverHoldsMoreThanItsBytes) {
  ParticleStore store(1000);
  for (size_t particles = 1; particles <= 90; ++particles) {
    EXPECT_EQ(store.Insert(std::to_string(particles), SetOf(particles)).ok(), particles <= 83);
    EXPECT_LE(store.bytes(), 1000U);
  }
  EXPECT_TRUE(store.Touch("83"));   // 996 bytes, the last that fits
  EXPECT_FALSE(store.Touch("84"));  // 1008 bytes
}

TEST(ParticleStore, SetsInUseStayAndOthersGoForThem) {
  ParticleStore store(2 * 120);
  EXPECT_TRUE(store.Insert("a", SetOf(10)).ok());
  EXPECT_TRUE(store.Insert("b", SetOf(10)).ok());
  auto used = store.Find("a");
  EXPECT_NE(store.Find("b"), nullptr);
  EXPECT_TRUE(store.Insert("c", SetOf(10)).ok());
  EXPECT_TRUE(store.Touch("a")) << "though it was used longest ago";
  EXPECT_FALSE(store.Touch("b"));
  const auto also_used = store.Find("c");
  const absl::Status full = store.CheckRoom(1);
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(DetailOf(full).reason, v1::ERROR_REASON_CACHE_FULL);
  EXPECT_TRUE(DetailOf(full).retry_after.has_value());
  EXPECT_EQ(store.Insert("d", SetOf(1)).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_FALSE(store.Touch("d"));
  EXPECT_TRUE(store.Insert("c", SetOf(10)).ok()) << "it is there";
  used.reset();
  EXPECT_TRUE(store.CheckRoom(120).ok());
  EXPECT_TRUE(store.Insert("d", SetOf(10)).ok());
  EXPECT_FALSE(store.Touch("a"));
  EXPECT_EQ(store.bytes(), 240U);
}

TEST(ParticleStore, SecondSetOfTheSameNameCostsNothing) {
  ParticleStore store(1000);
  const auto first = SetOf(10);
  EXPECT_TRUE(store.Insert("a", first).ok());
  EXPECT_TRUE(store.Insert("a", SetOf(10)).ok());
  EXPECT_EQ(store.bytes(), 120U);
  EXPECT_EQ(store.Find("a"), first);
}

TEST(ParticleStore, EveryAttributeCounts) {
  ParticleSet set;
  set.positions.resize(2);
  set.radii.resize(2);
  set.opacities.resize(2);
  set.colors.resize(2);
  set.velocities.resize(2);
  set.emissions.resize(2);
  EXPECT_EQ(MemoryBytes(set), 2U * (4 * 12 + 2 * 4));
}

TEST(ParticleStore, ManyThreadsAtOnceKeepTheBound) {
  ParticleStore store(1200);
  std::vector<std::jthread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&store, t] {
      for (int i = 0; i < 500; ++i) {
        const std::string name = std::to_string((i * (t + 1)) % 37);
        if (const auto set = store.Find(name)) {
          EXPECT_EQ(set->size(), 10U);
        } else {
          // Refused where others hold what would have to go.
          store.Insert(name, SetOf(10)).IgnoreError();
        }
      }
    });
  }
  threads.clear();
  EXPECT_EQ(store.bytes(), 1200U);
}

}  // namespace
}  // namespace halflight
