// Runs a function over ranges on all cores, whose threads wait between calls. Knows no priorities.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <thread>

namespace halflight {

// Calls `task` once for each of [0, count), on this thread and on those of the cores that have
// nothing else to do, and returns when all have finished. Any thread, several at once, and from
// within a task: whoever calls does itself what no other thread takes. `task` must not throw. The
// threads start with the first call that needs them, and end with the process.
void RunOnCores(size_t count, const std::function<void(size_t)>& task);

inline size_t CoreCount() { return std::max(1U, std::thread::hardware_concurrency()); }

// The worker that ParallelRanges gives a range to, and the range.
struct WorkRange {
  size_t worker;
  size_t begin;
  size_t end;
};

// How many ranges ParallelRanges makes of `count` items: a core is worth waking for 16,384 of them.
inline size_t WorkerCount(size_t count) {
  constexpr size_t kLeastItems = 16384;
  return std::clamp<size_t>(count / kLeastItems, 1, CoreCount());
}

// Calls `work` for consecutive ranges that together cover [0, count), one a worker, and returns
// when all have finished. As RunOnCores otherwise.
inline void ParallelRanges(size_t count, const std::function<void(const WorkRange&)>& work) {
  const size_t workers = WorkerCount(count);
  RunOnCores(workers, [&](size_t worker) {
    work({worker, count * worker / workers, count * (worker + 1) / workers});
  });
}

}  // namespace halflight
