// What the soak's figures rest on: bounds that are missed, slopes, the page.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/soak/page.h"
#include "tests/soak/report.h"
#include "tests/soak/statistics.h"

namespace halflight::soak {
namespace {

TEST(SoakReport, HoldsWhatIsReachedToItsBound) {
  Report report(/*timed=*/true);
  report.AtMost("a", 5, 5, " MiB");
  report.AtLeast("b", 5, 5, "");
  report.None("c", 0);
  report.TimeAtMost("d", 1, 2, " ms");
  EXPECT_TRUE(report.ok());
  report.AtMost("e", 5.01, 5, " MiB");
  report.AtLeast("f", 4.99, 5, "");
  report.None("g", 1);
  report.TimeAtMost("h", 2.1, 2, " ms");
  report.RateAtLeast("i", 1.9, 2, "");
  report.Holds("j", false);
  for (size_t i = 0; i < report.rows().size(); ++i) {
    EXPECT_EQ(report.rows()[i].ok, i < 4) << report.rows()[i].property;
  }
  EXPECT_FALSE(report.ok());
}

TEST(SoakReport, OnlyTellsTimesWhereTheMachineIsNotIdle) {
  Report report(/*timed=*/false);
  report.TimeAtMost("a", 3, 2, " ms");
  report.RateAtLeast("b", 1, 2, "");
  EXPECT_TRUE(report.ok());
  EXPECT_EQ(LineOf("s", report.rows()[0]), "| s | a | 3 ms | told |  |");
  report.AtMost("c", 3, 2, "");
  EXPECT_FALSE(report.ok());
}

TEST(SoakStatistics, SlopeIsNotMovedByOutliers) {
  std::vector<Point> points;
  for (int i = 0; i < 12; ++i) {
    points.push_back({0.1 * i, 40.0 + 0.3 * i + (i % 2 == 0 ? 0.01 : -0.01)});
  }
  points[3].y += 100.0;
  const Slope slope = SlopeOf(points);
  EXPECT_NEAR(slope.value, 3.0, 0.1);
  EXPECT_LT(slope.low, 3.0);
  EXPECT_GT(slope.high, 3.0);
}

TEST(SoakStatistics, FewPointsSayLittle) {
  const Slope slope = SlopeOf({{0, 0}, {1, 1}, {2, -5}});
  EXPECT_EQ(slope.low, -6.0);
  EXPECT_EQ(slope.high, 1.0);
}

TEST(SoakPage, BlocksAreReplacedWhereTheyStandOrAdded) {
  const std::string page =
      "# Title\n\n<!-- soak: a -->\nold\n<!-- end -->\nbetween\n<!-- soak: b -->\nkept\n<!-- end "
      "-->\n";
  EXPECT_EQ(WithBlock(page, "a", "new\n"),
            "# Title\n\n<!-- soak: a -->\nnew\n<!-- end -->\nbetween\n<!-- soak: b -->\nkept\n"
            "<!-- end -->\n");
  EXPECT_EQ(WithBlock("# Title\n", "a", "new\n"),
            "# Title\n\n<!-- soak: a -->\nnew\n<!-- end -->\n");
}

}  // namespace
}  // namespace halflight::soak
