// Cuts orders of particles into runs whose lists and patches fit into memory, by one wait for the
// device whatever their number. A particle's patch has one float for each texel of its rectangle on
// the light buffer. Sweeps and lists nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/gpu.h"
#include "renderer/sweep/device/lists.h"
#include "shaders/bindings.h"

namespace halflight::sweep {

// Entries of the tile lists of one run, at most: 128 MiB of them, and thrice that while they are
// sorted. No more than a storage block holds.
inline constexpr size_t kMostRunEntries = size_t{1} << 25U;

// Of one run: more texels only where a single particle has them, and no more than a storage block
// holds.
struct PatchRunLimits {
  size_t texels = shader::kMaxPatchTexels;
  // No tile lists more particles than its run has, and a sweep's loop over a tile goes by four:
  // this many stay below the 65,535 iterations after which llvmpipe ends an invocation's loops.
  size_t places = size_t{1} << 17U;
  size_t entries = kMostRunEntries;
};

// For GPUs, whose loops end when they should: every run ends with its longest tile. 256 MiB of
// patches, one run for a million particles of 64 texels.
inline constexpr PatchRunLimits kLongRuns = {.texels = size_t{1} << 26U,
                                             .places = size_t{1} << 24U};

struct PatchRun {
  PlaceRun places;
  size_t entries = 0;  // of its tile lists
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

// For tiles of the light buffer of `tile_size` texels along each side. Waits for the device and
// reads 8 bytes a group back, and of groups that alone exceed a run 8 a place. ResourceExhausted
// where one particle covers more than shader::kMaxPatchTexels. Needs a current context.
absl::StatusOr<PatchRuns> CutIntoPatchRuns(Gpu& gpu, const DeviceSprites& sprites, int tile_size,
                                           const PatchRunLimits& limits);

// Part of an order, and what its tile lists hold.
struct ListedRun {
  PlaceRun places;
  size_t entries = 0;
};

// All places of an order, in runs that begin at multiples of shader::kScanGroupSize, of at most
// `most_places` places, or a group, and of as many entries of tile lists as one run may have. Waits
// for the device and reads 4 bytes a group back. ResourceExhausted where a group has more. Needs a
// current context.
absl::StatusOr<std::vector<ListedRun>> CutIntoListedRuns(Gpu& gpu, const DeviceSprites& sprites,
                                                         int tile_size, size_t most_places);

// Binds the run's shader::PlaceRunBlock, and returns it.
gl::Buffer BindRun(const PatchRun& run, int light_buffer_size);

}  // namespace halflight::sweep
