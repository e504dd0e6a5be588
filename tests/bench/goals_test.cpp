// What the goals make of rows, and what becomes of figures and page.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/bench/contestants.h"
#include "tests/bench/figures.h"
#include "tests/bench/goals.h"

namespace halflight::bench {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

Row RowOf(const std::string& name, Role role, std::vector<double> milliseconds, double error) {
  Row row;
  row.name = name;
  row.role = role;
  row.milliseconds = std::move(milliseconds);
  row.error = measure::FrameError{.rmse = error};
  return row;
}

// Two baselines; of ours the fast one is worse than both, the middle one worse than the second.
Results MadeUp() {
  Results results;
  results.frame = {RowOf("plain", Role::kBaseline, {100, 300}, 0.4),
                   RowOf("interpolated", Role::kBaseline, {120, 360}, 0.2),
                   RowOf("fast", Role::kOurs, {1, 3}, 0.5),
                   RowOf("middle", Role::kOurs, {20, 60}, 0.3),
                   RowOf("right", Role::kOurs, {40, 120}, 0.02),
                   RowOf("slow", Role::kOurs, {50, 150}, 0.01),
                   RowOf("by hand", Role::kYardstick, {10, 30}, 0.2)};
  return results;
}

TEST(Goals, HoldTheFastestThatErrsNoMoreToEachBaseline) {
  const std::vector<Goal> goals = JudgeRenderer(MadeUp());
  ASSERT_EQ(goals.size(), 3U);
  EXPECT_EQ(goals[0].how, "middle");
  EXPECT_EQ(goals[0].reached, 5.0);
  EXPECT_TRUE(goals[0].met());
  EXPECT_EQ(goals[1].how, "right");
  EXPECT_EQ(goals[1].reached, 3.0);
  EXPECT_FALSE(goals[1].met());
}

TEST(Goals, HoldWhatIsNoWorseThanEveryBaselineToTheYardstick) {
  const std::vector<Goal> goals = JudgeRenderer(MadeUp());
  EXPECT_EQ(goals.back().how, "right");
  EXPECT_EQ(goals.back().reached, 4.0);
  EXPECT_FALSE(goals.back().met());
}

TEST(Goals, ThatNothingReachesInErrorAreNotJudged) {
  Results results = MadeUp();
  for (Row& row : results.frame) {
    if (row.role == Role::kOurs) row.error->rmse = 0.9;
  }
  EXPECT_THAT(JudgeRenderer(results), IsEmpty());
  EXPECT_THAT(JudgeRenderer(Results{}), IsEmpty());
}

TEST(Goals, LeaveOutWhatFailed) {
  Results results = MadeUp();
  const auto fail = [](Row& row) {
    row.failure = "no";
    row.milliseconds.clear();
    row.error.reset();
  };
  fail(results.frame.front());
  fail(results.frame.back());
  results.turntable = {RowOf("ours, first", Role::kOurs, {1}, 0),
                       RowOf("ours, following", Role::kOurs, {1}, 0)};
  fail(results.turntable.back());
  const std::vector<Goal> goals = JudgeRenderer(results);
  ASSERT_EQ(goals.size(), 1U);
  EXPECT_THAT(goals[0].what, HasSubstr("interpolated"));
  results.goals = goals;
  EXPECT_THAT(WriteFigures(results, {}), HasSubstr("\"failure\":\"no\""));
}

TEST(Goals, TakeTheLargestChangeOverSlicesOfOursAlone) {
  Results results;
  for (const auto& [slices, milliseconds] : {std::pair(16, 10.0), {64, 9.2}, {256, 10.5}}) {
    results.slices.push_back(RowOf("classic", Role::kClassic, {milliseconds * slices}, 0.1));
    results.slices.push_back(RowOf("ours", Role::kOurs, {milliseconds}, 0.1));
    for (Row& row : results.slices) {
      if (row.slices == 0) row.slices = slices;
    }
  }
  const std::vector<Goal> goals = JudgeRenderer(results);
  ASSERT_EQ(goals.size(), 1U);
  EXPECT_NEAR(goals[0].reached, 0.08, 1e-9);
  EXPECT_TRUE(goals[0].met());
  EXPECT_THAT(goals[0].what, HasSubstr("16 to 256"));
}

TEST(Goals, CompareTheFramesOfATurntableWithTheFirst) {
  Results results;
  results.turntable = {RowOf("classic, first", Role::kBaseline, {100}, 0),
                       RowOf("classic, following", Role::kBaseline, {100}, 0),
                       RowOf("ours, first", Role::kOurs, {40, 44}, 0),
                       RowOf("ours, following", Role::kOurs, {20, 22}, 0)};
  const std::vector<Goal> goals = JudgeRenderer(results);
  ASSERT_EQ(goals.size(), 1U);
  EXPECT_EQ(goals[0].reached, 0.5);
  EXPECT_TRUE(goals[0].met());
}

TEST(Row, CountsFramesASecondByTheDeviceAlone) {
  Row row;
  EXPECT_FALSE(row.device_frames_per_second().has_value());
  row.stages = {{"sort", 100.0, false}, {"light", 3.0, true}, {"composite", 2.0, true}};
  EXPECT_DOUBLE_EQ(*row.device_frames_per_second(), 200.0);
}

TEST(Contestants, HaveNamesOfTheirOwnABaselineAndOurs) {
  for (const auto& [short_form, software] :
       {std::pair(false, true), {true, true}, {false, false}}) {
    std::vector<std::string> names;
    for (const Contestant& contestant : ListContestants(short_form, software)) {
      EXPECT_THAT(names, testing::Not(testing::Contains(contestant.name)));
      names.push_back(contestant.name);
    }
    EXPECT_THAT(names,
                testing::IsSupersetOf({"classic, 64 slices", "classic, 64 slices interpolated",
                                       "light sweep, degree 0, buffer 256"}));
  }
}

TEST(Figures, HoldEveryTurn) {
  Results results = MadeUp();
  results.goals = JudgeRenderer(results);
  const std::string text = WriteFigures(results, {});
  EXPECT_THAT(text, HasSubstr("\"name\":\"middle\",\"role\":\"ours\""));
  EXPECT_THAT(text, HasSubstr("\"milliseconds\":[20,\n60]"));
  EXPECT_THAT(text, HasSubstr("\"rmse\":0.3"));
}

}  // namespace
}  // namespace halflight::bench
