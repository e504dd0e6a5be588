// What the cache of frames finds again, and what it lets go.
#include "renderer/frame_cache.h"

#include <gtest/gtest.h>

#include <string>

namespace halflight {
namespace {

struct Bytes {
  size_t size = 0;
  std::string text;

  [[nodiscard]] size_t bytes() const { return size; }
};

struct NumberKey {
  using Value = Bytes;
  int number = 0;

  bool operator==(const NumberKey&) const = default;
};

// The same members, another type.
struct OtherKey {
  using Value = Bytes;
  int number = 0;

  bool operator==(const OtherKey&) const = default;
};

std::shared_ptr<const ParticleSet> MakeSet() { return std::make_shared<ParticleSet>(); }

constexpr size_t kSize = 100'000;  // beside which what an entry itself takes does not count
constexpr size_t kRoomForThree = 3 * kSize + kSize / 2;

// Whether it had to be made.
template <typename Key>
bool Makes(FrameCache& cache, const std::shared_ptr<const ParticleSet>& set, const Key& key,
           size_t size = kSize) {
  bool made = false;
  const auto value = cache.FindOrMake(set, key, [&]() -> absl::StatusOr<Bytes> {
    made = true;
    return Bytes{size, std::to_string(key.number)};
  });
  EXPECT_TRUE(value.ok());
  EXPECT_EQ((*value)->text, std::to_string(key.number));
  return made;
}

TEST(FrameCache, FindsWhatWasMadeForTheSameSetAndKeyOnly) {
  FrameCache cache(kRoomForThree);
  const auto set = MakeSet();
  const auto other_set = MakeSet();
  EXPECT_TRUE(Makes(cache, set, NumberKey{1}));
  EXPECT_FALSE(Makes(cache, set, NumberKey{1}));
  EXPECT_TRUE(Makes(cache, set, NumberKey{2}));
  EXPECT_TRUE(Makes(cache, set, OtherKey{1}));
  EXPECT_FALSE(Makes(cache, set, NumberKey{1}));
  EXPECT_TRUE(Makes(cache, other_set, NumberKey{1}));
  EXPECT_EQ(cache.found(), 2U);
}

TEST(FrameCache, LetsGoWhatWasUsedLongestAgo) {
  FrameCache cache(kRoomForThree);
  const auto set = MakeSet();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(Makes(cache, set, NumberKey{i}));
  EXPECT_FALSE(Makes(cache, set, NumberKey{0}));
  EXPECT_TRUE(Makes(cache, set, NumberKey{3}));
  EXPECT_FALSE(Makes(cache, set, NumberKey{0}));
  EXPECT_FALSE(Makes(cache, set, NumberKey{2}));
  EXPECT_TRUE(Makes(cache, set, NumberKey{1}));
  EXPECT_LE(cache.bytes(), kRoomForThree);
}

TEST(FrameCache, DoesNotKeepWhatIsLargerThanItsBound) {
  FrameCache cache(kRoomForThree);
  const auto set = MakeSet();
  EXPECT_TRUE(Makes(cache, set, NumberKey{1}));
  EXPECT_TRUE(Makes(cache, set, NumberKey{2}, kRoomForThree));
  EXPECT_TRUE(Makes(cache, set, NumberKey{2}, kRoomForThree));
  EXPECT_FALSE(Makes(cache, set, NumberKey{1}));
  FrameCache nothing(0);
  EXPECT_TRUE(Makes(nothing, set, NumberKey{1}, 0));
  EXPECT_TRUE(Makes(nothing, set, NumberKey{1}, 0));
  EXPECT_TRUE(nothing.empty());
}

TEST(FrameCache, KeepsNoSetAliveAndForgetsThoseThatAreGone) {
  FrameCache cache(kRoomForThree);
  auto set = MakeSet();
  const auto other_set = MakeSet();
  EXPECT_TRUE(Makes(cache, set, NumberKey{1}));
  EXPECT_TRUE(Makes(cache, other_set, NumberKey{1}));
  const std::weak_ptr<const ParticleSet> watch = set;
  set.reset();
  EXPECT_TRUE(watch.expired());
  const size_t before = cache.bytes();
  cache.ForgetGoneSets();
  EXPECT_EQ(cache.bytes(), before / 2);
  EXPECT_FALSE(Makes(cache, other_set, NumberKey{1}));
}

// Whatever address a new set gets, it is not taken for one that is gone.
TEST(FrameCache, TellsSetsApartThatLivedAtOneAddress) {
  FrameCache cache(kRoomForThree);
  alignas(ParticleSet) std::byte room[sizeof(ParticleSet)];
  const auto set_in_room = [&] {
    return std::shared_ptr<const ParticleSet>(new (room) ParticleSet,
                                              [](const ParticleSet* set) { set->~ParticleSet(); });
  };
  auto set = set_in_room();
  EXPECT_TRUE(Makes(cache, set, NumberKey{1}));
  EXPECT_FALSE(Makes(cache, set, NumberKey{1}));
  set.reset();
  set = set_in_room();
  EXPECT_TRUE(Makes(cache, set, NumberKey{1}));
}

TEST(FrameCache, KeepsNothingOfWhatFailed) {
  FrameCache cache(kRoomForThree);
  const auto set = MakeSet();
  const auto failed = cache.FindOrMake(
      set, NumberKey{1}, []() -> absl::StatusOr<Bytes> { return absl::CancelledError("stop"); });
  EXPECT_TRUE(absl::IsCancelled(failed.status()));
  EXPECT_TRUE(cache.empty());
  EXPECT_TRUE(Makes(cache, set, NumberKey{1}));
}

TEST(FrameCache, ValuesOutliveTheirEntries) {
  FrameCache cache(kRoomForThree);
  const auto set = MakeSet();
  const auto value = cache.FindOrMake(set, NumberKey{1}, []() -> absl::StatusOr<Bytes> {
    return Bytes{kSize, "still here"};
  });
  cache.Clear();
  EXPECT_EQ(cache.bytes(), 0U);
  EXPECT_EQ((*value)->text, "still here");
}

}  // namespace
}  // namespace halflight
