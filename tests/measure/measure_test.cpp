// Medians, turns and replicas.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "tests/measure/machine.h"
#include "tests/measure/replicate.h"
#include "tests/measure/timing.h"

namespace halflight::measure {
namespace {

ParticleSet Row(size_t count) {
  ParticleSet set;
  set.origin = {1, 2, 3};
  for (size_t i = 0; i < count; ++i) set.positions.emplace_back(static_cast<float>(i), 0, 0);
  return set;
}

TEST(Median, IsTheMiddle) {
  EXPECT_EQ(Median({3, 1, 2}), 2);
  EXPECT_EQ(Median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(Median({5}), 5);
}

TEST(Quantile, LiesBetweenTheValuesInProportion) {
  EXPECT_EQ(Quantile({5, 1, 3, 2, 4}, 0.25), 2);
  EXPECT_EQ(Quantile({10, 20}, 0.25), 12.5);
  EXPECT_EQ(Quantile({3, 1, 2}, 0.0), 1);
  EXPECT_EQ(Quantile({3, 1, 2}, 1.0), 3);
}

TEST(MedianRatio, IsTakenWithinTurns) {
  const auto ratio = [](const std::vector<double>& a, const std::vector<double>& b) {
    return MedianRatio(a, b);
  };
  // The machine slows down to a third after the first turn.
  EXPECT_EQ(ratio({2, 6, 6}, {1, 3, 3}), 2);
  // One turn disturbed.
  EXPECT_EQ(ratio({2, 90, 2}, {1, 1, 1}), 2);
}

TEST(CpuSeconds, GrowWithWhatThisProgramDoes) {
  const CpuSeconds begin = CpuSecondsSoFar();
  CpuSeconds now = begin;
  volatile double sum = 0.0;
  while (now.own < begin.own + 1.0 && !(now.own > begin.own && now.all > begin.all)) {
    for (int i = 0; i < 100000; ++i) sum = sum + i;
    now = CpuSecondsSoFar();
  }
  EXPECT_GT(now.own, begin.own);
  EXPECT_GT(now.all, begin.all);
}

TEST(Stages, AreMediansInTheOrderOfTheFirstRepeat) {
  TimedFrame frame;
  frame.stages = {{{"sort", 3}, {"composite", 10}},
                  {{"sort", 1}, {"composite", 30}},
                  {{"sort", 2}, {"composite", 20}}};
  const std::vector<StageTiming> stages = MedianStages(frame);
  ASSERT_EQ(stages.size(), 2U);
  EXPECT_EQ(stages[0].stage, "sort");
  EXPECT_EQ(stages[0].milliseconds, 2);
  EXPECT_EQ(stages[1].stage, "composite");
  EXPECT_EQ(stages[1].milliseconds, 20);
}

// Draws nothing; writes down who was asked, and for which particles.
struct Recorder {
  std::string asked;
  std::set<std::shared_ptr<const ParticleSet>> seen;  // keeps them, so that none is another's place

  Draw As(char name) {
    return [this, name](const FrameRequest& request) -> absl::StatusOr<FrameResult> {
      asked += name;
      seen.insert(request.scene.particles);
      FrameResult result;
      result.images = {{1, 1, 1, {"A"}, {static_cast<float>(asked.size())}}};
      return result;
    };
  }
};

TEST(Turns, GoRoundWithParticlesThatWereNeverSeen) {
  Recorder recorder;
  Scene scene;
  scene.particles = std::make_shared<const ParticleSet>(Row(1));
  const std::vector<Entrant> entrants = {{recorder.As('a'), scene}, {recorder.As('b'), scene}};
  const std::vector<TimedFrame> frames = TimeInTurns(entrants, 3);
  EXPECT_EQ(recorder.asked, "abababab");
  EXPECT_EQ(recorder.seen.size(), 8U);
  EXPECT_FALSE(recorder.seen.contains(scene.particles));
  for (const TimedFrame& frame : frames) EXPECT_EQ(frame.milliseconds.size(), 3U);
  EXPECT_EQ(frames[1].beauty.pixels, std::vector<float>{2});  // of the turn that warms up
}

TEST(Turns, LeaveOutWhoseFrameFails) {
  Recorder recorder;
  int refused = 0;
  const Draw refuse = [&](const FrameRequest&) -> absl::StatusOr<FrameResult> {
    ++refused;
    return absl::InvalidArgumentError("no");
  };
  Scene scene;
  scene.particles = std::make_shared<const ParticleSet>();
  const std::vector<TimedFrame> frames =
      TimeInTurns(std::vector<Entrant>{{refuse, scene}, {recorder.As('a'), scene}}, 2);
  EXPECT_EQ(frames[0].status.message(), "no");
  EXPECT_EQ(refused, 1);
  EXPECT_EQ(recorder.asked, "aaa");
}

double SumOfOpticalDepths(const Replica& replica) {
  return -static_cast<double>(replica.particles->size()) *
         std::log1p(-static_cast<double>(replica.opacity));
}

TEST(Replica, KeepsTheSumOfOpticalDepths) {
  const ParticleSet source = Row(100);
  const double expected = -100 * std::log1p(-0.18);
  for (const size_t count : {25U, 99U, 100U, 101U, 1000U, 3333U}) {
    const Replica replica = Replicate(source, count, 0.18F, 0.1F);
    EXPECT_EQ(replica.particles->size(), count);
    EXPECT_EQ(replica.particles->origin, source.origin);
    EXPECT_NEAR(SumOfOpticalDepths(replica) / expected, 1.0, 1e-5) << count;
  }
}

TEST(Replica, OfTheSameCountIsTheSource) {
  const ParticleSet source = Row(50);
  const Replica replica = Replicate(source, 50, 0.3F, 0.1F);
  EXPECT_EQ(replica.particles->positions, source.positions);
  EXPECT_NEAR(replica.opacity, 0.3F, 1e-6);
}

TEST(Replica, SpreadsCopiesEvenlyAndNoFartherThanTheJitter) {
  const Replica replica = Replicate(Row(10), 70, 0.3F, 0.2F);
  std::vector<int> copies(10);
  double farthest = 0.0;
  glm::dvec3 mean(0.0);
  for (const glm::vec3& position : replica.particles->positions) {
    const auto original = static_cast<size_t>(std::lround(position.x));
    ++copies.at(original);
    const glm::dvec3 moved = glm::dvec3(position) - glm::dvec3(original, 0, 0);
    farthest = std::max(farthest, glm::length(moved));
    mean += moved / 70.0;
  }
  EXPECT_THAT(copies, testing::Each(7));
  EXPECT_LE(farthest, 0.2001);
  EXPECT_GT(farthest, 0.1);
  EXPECT_LT(glm::length(mean), 0.05);
}

TEST(Replica, IsTheSameEachTime) {
  EXPECT_EQ(Replicate(Row(10), 35, 0.3F, 0.2F).particles->positions,
            Replicate(Row(10), 35, 0.3F, 0.2F).particles->positions);
  EXPECT_NE(Replicate(Row(10), 35, 0.3F, 0.2F, 2).particles->positions,
            Replicate(Row(10), 35, 0.3F, 0.2F).particles->positions);
}

}  // namespace
}  // namespace halflight::measure
