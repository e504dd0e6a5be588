#include "renderer/reference/sorted_order.h"

#include <algorithm>
#include <numeric>

namespace halflight::reference {

std::vector<uint32_t> SortedOrder(std::span<const double> values, const std::stop_token& stop) {
  // Sorted in runs, then merged: between them is where a long sort can be stopped.
  constexpr size_t kRun = 32768;
  const auto before = [values](uint32_t a, uint32_t b) {
    return values[a] != values[b] ? values[a] < values[b] : a < b;
  };
  const size_t count = values.size();
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  const auto at = [&order, count](size_t index) {
    return order.begin() + static_cast<std::ptrdiff_t>(std::min(index, count));
  };
  for (size_t begin = 0; begin < count && !stop.stop_requested(); begin += kRun) {
    std::sort(at(begin), at(begin + kRun), before);
  }
  for (size_t run = kRun; run < count; run *= 2) {
    for (size_t begin = 0; begin < count && !stop.stop_requested(); begin += 2 * run) {
      std::inplace_merge(at(begin), at(begin + run), at(begin + 2 * run), before);
    }
  }
  return order;
}

}  // namespace halflight::reference
