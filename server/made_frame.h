// A frame between rendering and sending: what was rendered, and what was found out about it. What
// was asked for stands in the job, whose scene names the settings that made the frame.
#pragma once

#include <optional>

#include "renderer/error_estimate.h"
#include "renderer/frame.h"
#include "renderer/image.h"
#include "renderer/target/search.h"

namespace halflight {

struct MadeFrame {
  FrameResult rendered;        // its images: those of the request, then the error's
  std::optional<Image> other;  // the beauty without scattering, where that one is compared
  double comparison_ms = 0.0;  // rendering it
  // There where the job has a measurement; all of its figures but the time are the last one's.
  std::optional<ErrorEstimate> error;
  double measurement_ms = 0.0;          // the last one, without rendering anything
  std::optional<TargetOutcome> target;  // there where the job has a target
};

}  // namespace halflight
