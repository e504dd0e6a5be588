// Cuts the light's order into runs whose patches fit into memory. A particle's patch has one float
// for each texel of its rectangle on the light buffer. Sweeps nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/gpu.h"
#include "renderer/sweep/device/lists.h"
#include "shaders/bindings.h"

namespace halflight::sweep {

// Of one run: more texels only where a single particle has them, and no more than a storage block
// holds.
struct PatchRunLimits {
  size_t texels = shader::kMaxPatchTexels;
  // No tile lists more particles than its run has, and a sweep's loop over a tile goes by four:
  // this many stay below the 65,535 iterations after which llvmpipe ends an invocation's loops.
  size_t places = size_t{1} << 17U;
};

// For GPUs, whose loops end when they should: every run waits for the device, to list its tiles,
// and for its longest tile. 256 MiB of patches, one run for a million particles of 64 texels.
inline constexpr PatchRunLimits kLongRuns = {.texels = size_t{1} << 26U,
                                             .places = size_t{1} << 24U};

struct PatchRun {
  PlaceRun places;
  size_t texels = 0;
  uint32_t texels_before = 0;  // of all runs before, modulo 2^32
};

struct PatchRuns {
  std::vector<PatchRun> runs;  // all places, in order
  // Where a patch begins among all, modulo 2^32: the sum of both, the first by place, the second by
  // groups of shader::kScanGroupSize places.
  gl::Buffer offsets;
  gl::Buffer group_offsets;
};

// Reads 4 bytes a group back, and of groups that alone exceed a run 4 a place. ResourceExhausted
// where one particle covers more than shader::kMaxPatchTexels. Needs a current context.
absl::StatusOr<PatchRuns> CutIntoPatchRuns(Gpu& gpu, const DeviceSprites& sprites,
                                           const PatchRunLimits& limits);

// Binds the run's shader::PlaceRunBlock, and returns it.
gl::Buffer BindRun(const PatchRun& run, int light_buffer_size);

}  // namespace halflight::sweep
