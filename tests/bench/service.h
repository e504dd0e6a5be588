// What the service adds to a frame: a halflightd on a unix socket, with its own settings.
#pragma once

#include "absl/status/status.h"
#include "renderer/frame_renderer.h"
#include "tests/bench/parts.h"
#include "tests/bench/results.h"

namespace halflight::bench {

// Measures the default path in `renderer` and over the wire, fills in Results::service, and adds
// its goals. The renderer's thread. Errors as LocalServer, Client and FrameRenderer; Internal where
// pixels that came over the wire are others than those drawn here.
absl::Status MeasureService(FrameRenderer& renderer, const MeasureOptions& options,
                            Results& results);

}  // namespace halflight::bench
