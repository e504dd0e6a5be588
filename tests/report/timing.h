// Times frames in turns, so that a machine that slows down slows all of them down alike.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame_renderer.h"
#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight::report {

// The middle value, of an even number the mean of the two in the middle. `values` is not empty.
double Median(std::vector<double> values);

struct TimedFrame {
  Image beauty;
  std::vector<double> milliseconds;  // one a repeat, from request to pixels in memory
};

// Draws every scene once to warm up, untimed, then all of them `repeats` times in turns. The
// renderer's thread. Errors as FrameRenderer::Render.
absl::StatusOr<std::vector<TimedFrame>> TimeInTurns(FrameRenderer& renderer,
                                                    std::span<const Scene> scenes, int repeats);

// The median over the repeats of what a frame took in parts of what `baseline` took in the same
// repeat; both were timed together.
double TimeRatio(const TimedFrame& frame, const TimedFrame& baseline);

}  // namespace halflight::report
