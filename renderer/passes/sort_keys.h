// Sorts on the device what was made there; renderer/sort.h sorts what is on the CPU, and is faster
// where the device is one.
#pragma once

#include <cstddef>

#include "absl/status/statusor.h"
#include "renderer/gpu.h"

namespace halflight {

// Items in buffers of the device, uint32 both.
struct KeyedValues {
  gl::Buffer keys;
  gl::Buffer values;
};

// Sorts the items by the lower `key_bits` bits of their keys (1 to 32; others must be 0), ascending
// and stable: equal keys keep their order, the same on every device. Takes the items' buffers, and
// uses them up; those returned may be larger. Without values those are the items' numbers, so that
// they become the order, as SortedOrder() gives it. Radix sort by 8 bits a pass, least significant
// first (Satish, Harris and Garland 2009, "Designing Efficient Sorting Algorithms for Manycore
// GPUs"). ResourceExhausted where a storage block does not hold the keys. Needs a current context.
absl::StatusOr<KeyedValues> SortKeys(Gpu& gpu, KeyedValues items, size_t count, int key_bits = 32);

}  // namespace halflight
