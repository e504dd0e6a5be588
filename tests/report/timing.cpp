#include "tests/report/timing.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace halflight::report {

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

absl::StatusOr<std::vector<TimedFrame>> TimeInTurns(FrameRenderer& renderer,
                                                    std::span<const Scene> scenes, int repeats) {
  std::vector<FrameRequest> requests;
  for (const Scene& scene : scenes) {
    // Each as if it were the first of its scene.
    requests.push_back({.scene = scene, .images = {{ImageKind::kBeauty}}, .reuse = false});
  }
  std::vector<TimedFrame> frames(scenes.size());
  for (int turn = 0; turn <= repeats; ++turn) {
    for (size_t i = 0; i < requests.size(); ++i) {
      const auto begin = std::chrono::steady_clock::now();
      absl::StatusOr<FrameResult> frame = renderer.Render(requests[i], {});
      const auto end = std::chrono::steady_clock::now();
      if (!frame.ok()) return frame.status();
      if (turn == 0) {
        frames[i].beauty = std::move(frame->images.at(0));
      } else {
        frames[i].milliseconds.push_back(
            std::chrono::duration<double, std::milli>(end - begin).count());
      }
    }
  }
  return frames;
}

double TimeRatio(const TimedFrame& frame, const TimedFrame& baseline) {
  std::vector<double> ratios;
  for (size_t turn = 0; turn < frame.milliseconds.size(); ++turn) {
    ratios.push_back(frame.milliseconds[turn] / baseline.milliseconds[turn]);
  }
  return Median(std::move(ratios));
}

}  // namespace halflight::report
