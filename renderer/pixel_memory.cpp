#include "renderer/pixel_memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace halflight {

namespace {

// glibc takes more than this from the system by itself and gives it back when it is freed, so that
// advice on its pages ends with it (M_MMAP_THRESHOLD in mallopt(3)).
constexpr size_t kLargestOnHeap = size_t{32} << 20U;
// Values between two looks at whether to stop: milliseconds, where the system has to find pages.
constexpr size_t kBetweenLooks = size_t{1} << 20U;

}  // namespace

void ReservePixels(size_t count, std::vector<float>& values) {
  if (count <= values.capacity()) return;
  values.reserve(count);
  if (count * sizeof(float) <= kLargestOnHeap) return;
  const auto page = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<uintptr_t>(values.data()) / page * page + page;
  const auto end = reinterpret_cast<uintptr_t>(values.data() + count) / page * page;
  // A hint: where the system has no huge pages, small ones serve.
  // NOLINTNEXTLINE(performance-no-int-to-ptr): whole pages are asked for
  madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

std::vector<float> Zeros(size_t count, const std::stop_token& stop) {
  std::vector<float> values;
  ReservePixels(count, values);
  while (values.size() < count && !stop.stop_requested()) {
    values.resize(std::min(count, values.size() + kBetweenLooks));
  }
  return values;
}

}  // namespace halflight
