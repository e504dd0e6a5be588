// Orders particles along an axis or by distance. Keeps no state.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace halflight {

// Maps a float to an unsigned integer of the same order. -0 and +0 get the same key; NaN must not
// come in.
inline uint32_t OrderedKey(float value) {
  const auto bits = std::bit_cast<uint32_t>(value == 0.0F ? 0.0F : value);
  const bool negative = (bits >> 31U) != 0;
  return negative ? ~bits : bits | 0x80000000U;
}

// The permutation that sorts `keys` ascending: result[k] is the index of the k-th smallest. Stable
// (equal keys keep the order of their indices), so the same input gives the same output on any
// number of cores. Least-significant-digit radix sort, in as few digits of at most 11 bits as
// cover those in which keys differ. renderer/passes/sort_keys.h sorts on the device, to the same
// order.
std::vector<uint32_t> SortedOrder(std::span<const uint32_t> keys);

}  // namespace halflight
