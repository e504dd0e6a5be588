#include "renderer/sort.h"

#include <array>
#include <bit>

#include "renderer/parallel.h"

namespace halflight {

namespace {

constexpr uint32_t kDigitBits = 11;
constexpr uint32_t kDigits = 1U << kDigitBits;
constexpr uint32_t kPasses = 3;  // 33 bits: enough for 32

struct Item {
  uint32_t key;
  uint32_t index;
};

using Histogram = std::array<size_t, kDigits>;

uint32_t Digit(uint32_t key, uint32_t pass) { return (key >> (pass * kDigitBits)) & (kDigits - 1); }

// Turns counts by worker and digit into the places where each worker's items of each digit begin:
// all of a digit together, earlier workers first, which keeps the sort stable.
void CountsToStarts(std::vector<Histogram>& by_worker) {
  size_t start = 0;
  for (uint32_t digit = 0; digit < kDigits; ++digit) {
    for (Histogram& histogram : by_worker) {
      const size_t count = histogram[digit];
      histogram[digit] = start;
      start += count;
    }
  }
}

}  // namespace

uint32_t OrderedKey(float value) {
  const auto bits = std::bit_cast<uint32_t>(value == 0.0F ? 0.0F : value);
  const bool negative = (bits >> 31U) != 0;
  return negative ? ~bits : bits | 0x80000000U;
}

std::vector<uint32_t> SortedOrder(std::span<const uint32_t> keys) {
  const size_t count = keys.size();
  std::vector<Item> items(count);
  std::vector<Item> sorted(count);
  ParallelRanges(count, [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end; ++i) {
      items[i] = {keys[i], static_cast<uint32_t>(i)};
    }
  });

  std::vector<Histogram> starts(WorkerCount(count));
  for (uint32_t pass = 0; pass < kPasses; ++pass) {
    ParallelRanges(count, [&](const WorkRange& range) {
      Histogram& histogram = starts[range.worker];
      histogram.fill(0);
      for (size_t i = range.begin; i < range.end; ++i) ++histogram[Digit(items[i].key, pass)];
    });
    CountsToStarts(starts);
    ParallelRanges(count, [&](const WorkRange& range) {
      Histogram& start = starts[range.worker];
      for (size_t i = range.begin; i < range.end; ++i) {
        sorted[start[Digit(items[i].key, pass)]++] = items[i];
      }
    });
    items.swap(sorted);
  }

  std::vector<uint32_t> order(count);
  ParallelRanges(count, [&](const WorkRange& range) {
    for (size_t k = range.begin; k < range.end; ++k) order[k] = items[k].index;
  });
  return order;
}

}  // namespace halflight
