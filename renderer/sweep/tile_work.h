// Work on tiles, whose sizes differ: each core takes the next one.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <stop_token>
#include <thread>
#include <vector>

namespace halflight::sweep {

// Calls `work` once for each of [0, count); false when `stop` ended it early. `work` must not
// throw.
template <typename Work>
bool ForTiles(size_t count, const std::stop_token& stop, const Work& work) {
  std::atomic<size_t> next = 0;
  const auto run = [&] {
    for (size_t tile = next++; tile < count && !stop.stop_requested(); tile = next++) work(tile);
  };
  {
    std::vector<std::jthread> threads;
    const size_t cores = std::max(1U, std::thread::hardware_concurrency());
    for (size_t i = 1; i < std::min(cores, count); ++i) threads.emplace_back(run);
    run();
  }
  return !stop.stop_requested();
}

}  // namespace halflight::sweep
