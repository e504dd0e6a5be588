// Prefix sums in buffers of the device. Reads nothing back.
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "renderer/gpu.h"

namespace halflight {

// Writes to `sums`, of count + 1 uint32, the exclusive prefix sums of the `count` uint32 in
// `values`: sums[k] = values[0] + ... + values[k - 1], so that the last is the total. A sum that
// exceeds 2^32 - 1 is that. `sums` may be `values`. At most 2^28 values, whatever the device's
// storage blocks hold; InvalidArgument beyond. Needs a current context.
absl::Status PrefixSum(Gpu& gpu, const gl::Buffer& values, size_t count, const gl::Buffer& sums);

}  // namespace halflight
