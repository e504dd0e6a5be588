#include "tests/bench/results.h"

namespace halflight::bench {

std::optional<double> Row::device_frames_per_second() const {
  double sum = 0.0;
  for (const StageTiming& stage : stages) {
    if (stage.on_device) sum += stage.milliseconds;
  }
  if (sum <= 0.0) return std::nullopt;
  return 1000.0 / sum;
}

}  // namespace halflight::bench
