#include "tests/measure/timing.h"

#include <algorithm>
#include <chrono>
#include <memory>

namespace halflight::measure {

double Quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  const double place = part * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, values.size() - 1);
  const double share = place - static_cast<double>(below);
  return (1.0 - share) * values[below] + share * values[above];
}

double Median(std::vector<double> values) { return Quantile(std::move(values), 0.5); }

Draw DrawWith(FrameRenderer& renderer) {
  return [&renderer](const FrameRequest& request) { return renderer.Render(request, {}); };
}

FrameRequest FirstSeen(const Scene& scene) {
  FrameRequest request{scene, {{ImageKind::kBeauty}}};
  request.scene.particles = std::make_shared<const ParticleSet>(*scene.particles);
  return request;
}

void TimeFrame(const Draw& draw, const FrameRequest& request, TimedFrame& frame) {
  if (!frame.status.ok()) return;
  const auto begin = std::chrono::steady_clock::now();
  absl::StatusOr<FrameResult> result = draw(request);
  const auto end = std::chrono::steady_clock::now();
  if (!result.ok()) {
    frame.status = result.status();
    return;
  }
  if (frame.beauty.pixels.empty()) frame.beauty = std::move(result->images.at(0));
  frame.milliseconds.push_back(std::chrono::duration<double, std::milli>(end - begin).count());
  frame.stages.push_back(std::move(result->timings));
}

std::vector<TimedFrame> TimeInTurns(std::span<const Entrant> entrants, int repeats) {
  std::vector<TimedFrame> frames(entrants.size());
  for (int turn = 0; turn <= repeats; ++turn) {
    for (size_t i = 0; i < entrants.size(); ++i) {
      if (!frames[i].status.ok()) continue;
      TimeFrame(entrants[i].draw, FirstSeen(entrants[i].scene), frames[i]);
      if (turn == 0) {
        frames[i].milliseconds.clear();
        frames[i].stages.clear();
      }
    }
  }
  return frames;
}

std::vector<StageTiming> MedianStages(const TimedFrame& frame) {
  std::vector<StageTiming> medians;
  if (frame.stages.empty()) return medians;
  for (StageTiming stage : frame.stages.front()) {
    std::vector<double> values;
    for (const std::vector<StageTiming>& repeat : frame.stages) {
      for (const StageTiming& timing : repeat) {
        if (timing.stage == stage.stage) values.push_back(timing.milliseconds);
      }
    }
    stage.milliseconds = Median(std::move(values));
    medians.push_back(std::move(stage));
  }
  return medians;
}

double MedianRatio(std::span<const double> milliseconds, std::span<const double> baseline) {
  std::vector<double> ratios;
  for (size_t turn = 0; turn < milliseconds.size(); ++turn) {
    ratios.push_back(milliseconds[turn] / baseline[turn]);
  }
  return Median(std::move(ratios));
}

}  // namespace halflight::measure
