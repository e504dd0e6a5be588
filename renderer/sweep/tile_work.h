// Work on tiles, whose sizes differ: each core takes the next one.
#pragma once

#include <cstddef>
#include <stop_token>

#include "renderer/parallel.h"

namespace halflight::sweep {

// Calls `work` once for each of [0, count); false when `stop` ended it early. As RunOnCores
// otherwise.
template <typename Work>
bool ForTiles(size_t count, const std::stop_token& stop, const Work& work) {
  RunOnCores(count, [&](size_t tile) {
    if (!stop.stop_requested()) work(tile);
  });
  return !stop.stop_requested();
}

}  // namespace halflight::sweep
