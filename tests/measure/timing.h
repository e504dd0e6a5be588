// Times frames in turns, so that a machine that slows down slows all of them down alike.
#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame_renderer.h"
#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight::measure {

// The value below which this part of them lies, between two of them in proportion: 0.5 is the
// median, 0.25 and 0.75 are the quartiles. `values` is not empty.
double Quantile(std::vector<double> values, double part);
double Median(std::vector<double> values);

// Makes a frame, start to end.
using Draw = std::function<absl::StatusOr<FrameResult>(const FrameRequest& request)>;
// `renderer` must outlive it.
Draw DrawWith(FrameRenderer& renderer);

// What takes part in the turns.
struct Entrant {
  Draw draw;
  Scene scene;
};

struct TimedFrame {
  absl::Status status;  // of the last frame; where it is an error, the rest says nothing
  Image beauty;
  std::vector<double> milliseconds;              // one a repeat, from request to pixels in memory
  std::vector<std::vector<StageTiming>> stages;  // one a repeat
};

// Draws every scene once to warm up, untimed, then all of them `repeats` times in turns. Each frame
// has particles that were never seen before, copied beforehand, so that nothing of an earlier frame
// can be used again. Whose frame fails is left out of the turns that follow. The thread of the
// renderers that draw.
std::vector<TimedFrame> TimeInTurns(std::span<const Entrant> entrants, int repeats);

// Times one frame and adds it, unless one of those before it failed; the first one's image is kept.
void TimeFrame(const Draw& draw, const FrameRequest& request, TimedFrame& frame);

// The scene's beauty, of a copy of its particles.
FrameRequest FirstSeen(const Scene& scene);

// The medians over the repeats, by stage, in the order in which the first repeat has them.
std::vector<StageTiming> MedianStages(const TimedFrame& frame);

// The median over the repeats of what a frame took in parts of what `baseline` took in the same
// repeat: both were timed together, and have one value a repeat.
double MedianRatio(std::span<const double> milliseconds, std::span<const double> baseline);

}  // namespace halflight::measure
