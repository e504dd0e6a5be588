// What a request means for the yardstick's kernels, and which it refuses.
// Leaves out particles: only what is the same for all of them.
#pragma once

#include "absl/status/status.h"
#include "renderer/frame.h"
#include "tests/bench/yardstick_kernels.h"

namespace halflight::bench {

// InvalidArgument, naming the field, for what is not in the yardstick's class.
absl::Status CheckYardstickRequest(const FrameRequest& request);

// Optical depth at a particle's centre.
double YardstickOpticalDepth(const Scene& scene);

// Of a request that passed the check. Places are offsets from the set's origin.
kernels::Views ViewsOf(const Scene& scene);
kernels::Lens LensOf(const Scene& scene);
kernels::Look LookOf(const Scene& scene);
kernels::Opacity OpacityOf(const Scene& scene);

}  // namespace halflight::bench
