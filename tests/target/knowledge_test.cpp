// What frames of a sequence know of each other, and who goes first.
#include <gtest/gtest.h>

#include <vector>

#include "tests/target/world.h"

namespace halflight {
namespace {

Settings Sliced(int slices) {
  Settings settings;
  settings.shadow.slices = slices;
  settings.shadow.light_buffer_size = 256;
  return settings;
}

TEST(TargetKnowledge, LetsTheFirstFrameLearnBeforeTheOthersChoose) {
  TargetKnowledge knowledge;
  std::vector<int> began;
  for (int frame = 0; frame < 3; ++frame) {
    knowledge.Enter([&began, frame] { began.push_back(frame); });
  }
  EXPECT_EQ(began, std::vector<int>{0});
  knowledge.Settle(false);  // cancelled: the next one leads
  EXPECT_EQ(began, (std::vector<int>{0, 1}));
  knowledge.Settle(true);
  EXPECT_EQ(began, (std::vector<int>{0, 1, 2}));
  knowledge.Settle(false);
  knowledge.Enter([&began] { began.push_back(3); });
  knowledge.Enter([&began] { began.push_back(4); });
  EXPECT_EQ(began, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(TargetKnowledge, LetsAFrameBeginAfterAllBeforeItFailed) {
  TargetKnowledge knowledge;
  int began = 0;
  knowledge.Enter([&began] { ++began; });
  knowledge.Settle(false);
  knowledge.Enter([&began] { ++began; });
  EXPECT_EQ(began, 2);
}

TEST(TargetKnowledge, IsSurerOfWhatItSawAndLessSoWithAge) {
  const SceneFeatures features = FeaturesOf(test::RandomScene(4));
  TargetKnowledge knowledge;
  const Expected prior = knowledge.Error(features, Sliced(64));
  knowledge.LearnError(features, Sliced(64), 0.5 * prior.value);
  knowledge.LearnTime(Sliced(64), 20.0);
  const Expected seen = knowledge.Error(features, Sliced(64));
  EXPECT_DOUBLE_EQ(seen.value, 0.5 * prior.value);
  EXPECT_LT(seen.deviation, prior.deviation);
  EXPECT_DOUBLE_EQ(knowledge.Time(Sliced(64))->value, 20.0);
  EXPECT_FALSE(knowledge.Time(Sliced(128)));
  knowledge.AgeByOneFrame();
  EXPECT_GT(knowledge.Error(features, Sliced(64)).deviation, seen.deviation);
  for (int i = 0; i < 100; ++i) knowledge.AgeByOneFrame();
  EXPECT_FALSE(knowledge.Time(Sliced(64)));
}

TEST(TargetKnowledge, FitsTheFloorFromTwoAttempts) {
  // Thin slices change nothing: the floor is what was seen, and a thousand slices will not help.
  const SceneFeatures features = FeaturesOf(test::RandomScene(4));
  TargetKnowledge knowledge;
  knowledge.LearnError(features, Sliced(32), 0.2);
  knowledge.LearnError(features, Sliced(256), 0.19);
  EXPECT_NEAR(knowledge.Error(features, Sliced(1024)).value, 0.19, 0.04);
}

TEST(TargetKnowledge, IgnoresErrorsThatAreNoNumbers) {
  const SceneFeatures features = FeaturesOf(test::RandomScene(4));
  TargetKnowledge knowledge;
  const double before = knowledge.Error(features, Sliced(64)).value;
  knowledge.LearnError(features, Sliced(64), std::nan(""));
  knowledge.LearnError(features, Sliced(64), 0.0);
  EXPECT_EQ(knowledge.Error(features, Sliced(64)).value, before);
}

}  // namespace
}  // namespace halflight
