// The benchmark as a program: flags, measuring, the page and the figures.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "renderer/frame_renderer.h"
#include "tests/bench/parts.h"

namespace halflight::bench {

// Measures more into the results, and judges it.
using ServicePart = std::function<absl::Status(FrameRenderer& renderer,
                                               const MeasureOptions& options, Results& results)>;

// Exit code of the program. `service` may be empty.
int RunProgram(int argc, char** argv, const ServicePart& service);

}  // namespace halflight::bench
