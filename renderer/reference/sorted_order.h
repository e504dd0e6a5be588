// Orders particles by a float64 value. Compares; leaves out what the value means.
#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

namespace halflight::reference {

// Indices by ascending value, ties by lower index. Soon after `stop` was requested: some order.
std::vector<uint32_t> SortedOrder(std::span<const double> values, const std::stop_token& stop);

}  // namespace halflight::reference
