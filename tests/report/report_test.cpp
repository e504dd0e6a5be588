// The report's own arithmetic: fronts, advice, axes and labels.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/report/advice.h"
#include "tests/report/chart.h"
#include "tests/report/error_map.h"
#include "tests/report/pareto.h"
#include "tests/report/scenes.h"
#include "tests/report/settings.h"

namespace halflight::report {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(ParetoFront, HoldsWhatNothingBeats) {
  const std::vector<CostAndError> points = {{1, 9}, {2, 5}, {2, 6}, {3, 5}, {4, 1}, {5, 2}};
  EXPECT_THAT(ParetoFront(points), ElementsAre(true, true, false, false, true, false));
}

TEST(ParetoFront, HoldsAllEqualsAndTheOnlyPoint) {
  EXPECT_THAT(ParetoFront(std::vector<CostAndError>{{1, 1}, {1, 1}}), ElementsAre(true, true));
  EXPECT_THAT(ParetoFront(std::vector<CostAndError>{{7, 7}}), ElementsAre(true));
  EXPECT_TRUE(ParetoFront({}).empty());
}

TEST(ParetoFront, OfRandomPointsFallsAndLeavesNonePointOutsideUnbeaten) {
  std::mt19937 random(3);
  std::vector<CostAndError> points;
  for (int i = 0; i < 200; ++i) {
    points.push_back({static_cast<double>(random() % 50), static_cast<double>(random() % 50)});
  }
  const std::vector<bool> front = ParetoFront(points);
  for (size_t i = 0; i < points.size(); ++i) {
    bool beaten_by_front = false;
    for (size_t k = 0; k < points.size(); ++k) {
      if (!front[k] || k == i) continue;
      // Two of the front trade one for the other, or are equal.
      if (front[i]) {
        EXPECT_EQ(points[i].cost<points[k].cost, points[i].error> points[k].error);
      }
      beaten_by_front |= points[k].cost <= points[i].cost && points[k].error <= points[i].error;
    }
    EXPECT_TRUE(front[i] || beaten_by_front);
  }
}

TEST(Settings, HaveNamesOfTheirOwnAndOneBaseline) {
  for (const bool short_form : {false, true}) {
    std::set<std::string> names;
    std::set<std::string> flags;
    int baselines = 0;
    for (const Setting& setting : ListSettings(short_form)) {
      EXPECT_TRUE(names.insert(setting.name).second) << setting.name;
      EXPECT_TRUE(flags.insert(setting.flags).second) << setting.flags;
      EXPECT_THAT(setting.name, Not(HasSubstr(",")));
      baselines += setting.baseline ? 1 : 0;
      if (setting.baseline) {
        EXPECT_GT(setting.scaling_most, 1'000'000U);
      }
    }
    EXPECT_EQ(baselines, 1);
  }
}

TEST(Lights, GoFromBesideTheCameraToBehindTheCloud) {
  double last = 0.0;
  for (const std::string& light : LightNames()) {
    EXPECT_GT(DegreesFromView(light), last) << light;
    last = DegreesFromView(light);
  }
  EXPECT_NEAR(DegreesFromView("90 degrees"), 90.0, 1e-9);
}

// Two scenes, three settings: a fast and wrong one, the baseline, a slow and right one.
Results MadeUpResults() {
  Results results;
  for (const char* light : {"front", "back"}) {
    results.scenes.push_back({.name = light,
                              .plume = "",
                              .light = light,
                              .opacity = "dense",
                              .part = Part::kMatrix,
                              .scene = {}});
  }
  for (const char* name : {"fast", "baseline", "right"}) {
    Setting setting;
    setting.name = name;
    setting.baseline = setting.name == "baseline";
    results.settings.push_back(setting);
  }
  const auto add = [&](size_t scene, size_t setting, double ratio, double error) {
    Measurement measurement{};
    measurement.scene = scene;
    measurement.setting = setting;
    measurement.time_ratio = ratio;
    measurement.error.rmse = error;
    results.measurements.push_back(measurement);
  };
  add(0, 0, 0.4, 0.1);
  add(0, 1, 1.0, 0.3);
  add(0, 2, 3.0, 0.01);
  add(1, 0, 0.6, 0.5);
  add(1, 1, 1.0, 0.2);
  add(1, 2, 5.0, 0.04);
  return results;
}

std::vector<Summary> SummariesOf(const Results& results, const std::string& light) {
  return Summarize(results,
                   [&](const ReportScene& scene) { return light.empty() || scene.light == light; });
}

TEST(Advice, GoesByTheWorstSceneAndTheMedianTime) {
  const std::vector<Summary> all = SummariesOf(MadeUpResults(), "");
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].time_ratio, 0.5);
  EXPECT_EQ(all[0].worst_error, 0.5);
  EXPECT_EQ(all[0].median_error, 0.3);
  EXPECT_EQ(all[2].time_ratio, 4.0);
  EXPECT_EQ(all[2].worst_error, 0.04);
  EXPECT_EQ(Fastest(all).setting, 0U);
}

TEST(Advice, TakesTheCheapestThatWillDo) {
  const Results results = MadeUpResults();
  const std::vector<Summary> all = SummariesOf(results, "");
  EXPECT_EQ(CheapestWithin(all, 0.5)->setting, 0U);
  EXPECT_EQ(CheapestWithin(all, 0.3)->setting, 1U);
  EXPECT_EQ(CheapestWithin(all, 0.29)->setting, 2U);
  EXPECT_FALSE(CheapestWithin(all, 0.01).has_value());
  EXPECT_EQ(BestInTimeOfBaseline(all).setting, 1U);
  // By direction: the fast one is the better one of the front light, and the baseline falls off the
  // front.
  const std::vector<Summary> front = SummariesOf(results, "front");
  EXPECT_EQ(CheapestWithin(front, 0.3)->setting, 0U);
  EXPECT_EQ(BestInTimeOfBaseline(front).setting, 0U);
  EXPECT_FALSE(front[1].on_front);
  EXPECT_TRUE(front[2].on_front);
  EXPECT_TRUE(SummariesOf(results, "nowhere").empty());
}

TEST(Axis, HoldsItsValuesAndHasTicks) {
  for (const auto& values : {std::vector<double>{0.001, 1.3}, {1.0}, {0.3, 0.31}, {8e3, 1e6}}) {
    const LogRange range = RangeAround(values);
    for (const double value : values) {
      EXPECT_LT(range.low, value);
      EXPECT_GT(range.high, value);
    }
    EXPECT_GE(range.high / range.low, 3.999);
    const std::vector<double> ticks = Ticks(range);
    EXPECT_GE(ticks.size(), 2U);
    EXPECT_LE(ticks.size(), 14U);
  }
}

// Text elements that hold `word`.
size_t CountOf(const std::string& svg, const std::string& word) {
  size_t count = 0;
  for (size_t at = svg.find(">" + word + "<"); at != std::string::npos;
       at = svg.find(">" + word + "<", at + 1)) {
    ++count;
  }
  return count;
}

TEST(Chart, PlacesLabelsOnlyWhereTheyAreClear) {
  Svg svg(400, 300, "test");
  const auto format = [](double) { return std::string(); };
  Chart chart(svg, {0, 0, 400, 300}, "", {{1, 10}, "", format}, {{1, 10}, "", format});
  const Point middle = chart.At(3, 3);
  for (int i = 0; i < 40; ++i) chart.Label(middle, "label", {});
  const size_t placed = CountOf(svg.Finish(), "label");
  EXPECT_GT(placed, 3U);   // there is room round the point
  EXPECT_LT(placed, 11U);  // but not for all
}

TEST(Chart, PutsValuesBeyondTheAxesOnTheFrame) {
  Svg svg(400, 300, "test");
  const auto format = [](double) { return std::string(); };
  Chart chart(svg, {0, 0, 400, 300}, "", {{1, 10}, "", format}, {{1, 10}, "", format});
  EXPECT_EQ(chart.At(0.1, 0.0).x, chart.At(1, 1).x);
  EXPECT_EQ(chart.At(0.1, 0.0).y, chart.At(1, 1).y);
  EXPECT_GT(chart.At(1, 1).y, chart.At(1, 10).y);
}

TEST(Svg, EscapesText) {
  Svg svg(10, 10, "a < b");
  svg.Text({0, 0}, "\"x & y\"");
  EXPECT_THAT(svg.Finish(), HasSubstr("a &lt; b"));
  EXPECT_THAT(svg.Finish(), HasSubstr("&quot;x &amp; y&quot;"));
}

TEST(ErrorColor, IsBlueBelowRedAboveAndEndsAtTheEnds) {
  const auto dark = ErrorColor(-0.3);
  const auto light = ErrorColor(0.3);
  EXPECT_GT(dark[2], dark[0]);
  EXPECT_GT(light[0], light[2]);
  EXPECT_EQ(ErrorColor(0.0), (std::array<uint8_t, 3>{247, 247, 247}));
  EXPECT_EQ(ErrorColor(-9.0), ErrorColor(-kErrorMapEnd));
  EXPECT_EQ(ErrorColor(9.0), ErrorColor(kErrorMapEnd));
}

}  // namespace
}  // namespace halflight::report
