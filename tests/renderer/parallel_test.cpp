// Work on all cores: each piece once, from any thread, and within work.
#include "renderer/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace halflight {
namespace {

TEST(RunOnCores, CallsEveryTaskOnceAndWaitsForAll) {
  for (const size_t count : {0, 1, 2, 3, 1000}) {
    for (int repeat = 0; repeat < 200; ++repeat) {
      std::vector<int> calls(count, 0);
      RunOnCores(count, [&](size_t i) { ++calls[i]; });
      ASSERT_EQ(calls, std::vector<int>(count, 1));
    }
  }
}

TEST(RunOnCores, MayBeCalledWithinATask) {
  std::vector<std::atomic<int>> calls(32 * 16 * 8);
  RunOnCores(32, [&](size_t i) {
    RunOnCores(16,
               [&](size_t j) { RunOnCores(8, [&](size_t k) { ++calls[(i * 16 + j) * 8 + k]; }); });
  });
  for (const std::atomic<int>& count : calls) ASSERT_EQ(count, 1);
}

TEST(RunOnCores, ServesSeveralThreadsAtOnce) {
  constexpr size_t kTasks = 5;
  std::atomic<size_t> wrong = 0;
  {
    std::vector<std::jthread> callers;
    for (int caller = 0; caller < 8; ++caller) {
      callers.emplace_back([&] {
        for (int repeat = 0; repeat < 500; ++repeat) {
          std::vector<int> calls(kTasks, 0);
          RunOnCores(kTasks, [&](size_t i) { ++calls[i]; });
          wrong += calls == std::vector<int>(kTasks, 1) ? 0 : 1;
        }
      });
    }
  }
  EXPECT_EQ(wrong, 0U);
}

// A task that waits for another needs a second thread, where there is a second core.
TEST(RunOnCores, UsesMoreThanOneCore) {
  if (CoreCount() == 1) GTEST_SKIP() << "one core";
  std::atomic<int> there = 0;
  RunOnCores(2, [&](size_t) {
    ++there;
    while (there < 2) std::this_thread::yield();
  });
  EXPECT_EQ(there, 2);
}

TEST(ParallelRanges, CoverAllItemsInOrderOneRangeAWorker) {
  for (const size_t count : {size_t{0}, size_t{5}, size_t{16384}, size_t{32768}, size_t{1000003}}) {
    const size_t workers = WorkerCount(count);
    std::vector<WorkRange> ranges(workers, {workers, 0, 0});
    ParallelRanges(count, [&](const WorkRange& range) { ranges[range.worker] = range; });
    size_t end = 0;
    for (size_t worker = 0; worker < workers; ++worker) {
      EXPECT_EQ(ranges[worker].worker, worker);
      EXPECT_EQ(ranges[worker].begin, end);
      end = ranges[worker].end;
    }
    EXPECT_EQ(end, count);
  }
}

}  // namespace
}  // namespace halflight
