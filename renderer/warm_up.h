// Small frames that need what most requests need, so that what is built when it is first needed is
// there before the first request: programs, the driver's own variants of them, threads.
// Renders nothing itself, and leaves out rare combinations: their first frame builds what it lacks.
#pragma once

#include <vector>

#include "renderer/frame.h"

namespace halflight {

// The commonest first. Each takes a few milliseconds once everything is built.
std::vector<FrameRequest> WarmUpFrames();

}  // namespace halflight
