// Runs a function over ranges on all cores; leaves scheduling to the system.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

namespace halflight {

// The worker that ParallelRanges gives a range to, and the range.
struct WorkRange {
  size_t worker;
  size_t begin;
  size_t end;
};

// How many ranges ParallelRanges makes of `count` items: a core is worth waking for 16,384 of them.
inline size_t WorkerCount(size_t count) {
  constexpr size_t kLeastItems = 16384;
  const size_t cores = std::max(1U, std::thread::hardware_concurrency());
  return std::clamp<size_t>(count / kLeastItems, 1, cores);
}

// Calls `work` for consecutive ranges that together cover [0, count), one a worker, and returns
// when all have finished. `work` must not throw.
inline void ParallelRanges(size_t count, const std::function<void(const WorkRange&)>& work) {
  const size_t workers = WorkerCount(count);
  std::vector<std::jthread> threads;
  for (size_t worker = 1; worker < workers; ++worker) {
    threads.emplace_back([&work, worker, workers, count] {
      work({worker, count * worker / workers, count * (worker + 1) / workers});
    });
  }
  work({0, 0, count / workers});
}

}  // namespace halflight
