// Threads of a team take each job once, and no stage begins before the last one ended.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include "tests/bench/team.h"

namespace halflight::bench {
namespace {

TEST(Team, TakesEachJobOfAStageOnce) {
  constexpr size_t kStages = 3;
  constexpr size_t kJobs = 9;
  std::array<std::array<std::atomic<int>, kJobs>, kStages> taken{};
  std::atomic<bool> early = false;
  Team team(4);
  team.Run([&](size_t thread) {
    for (size_t stage = 0; stage < kStages; ++stage) {
      for (size_t job = team.TakeJob(); job < kJobs; job = team.TakeJob()) {
        ++taken[stage][job];
        if (stage > 0) {
          for (const std::atomic<int>& before : taken[stage - 1]) early = early || before == 0;
        }
        // The last job is still under way when all other threads have found nothing more to do.
        if (job == kJobs - 1) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
      team.EndStage(thread, "stage");
    }
  });
  for (const auto& stage : taken) {
    for (const std::atomic<int>& times : stage) EXPECT_EQ(times, 1);
  }
  EXPECT_FALSE(early);
  EXPECT_EQ(std::move(team).timings().size(), kStages);
}

TEST(Team, SharesAllOfARange) {
  const Team team(3);
  size_t next = 0;
  for (size_t thread = 0; thread < 3; ++thread) {
    const auto [begin, end] = team.Share(thread, 100);
    EXPECT_EQ(begin, next);
    next = end;
  }
  EXPECT_EQ(next, 100U);
}

}  // namespace
}  // namespace halflight::bench
