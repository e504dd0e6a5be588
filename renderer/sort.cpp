#include "renderer/sort.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <utility>

#include "renderer/parallel.h"

namespace halflight {

namespace {

constexpr int kMaxDigitBits = 11;  // what caches still hold the places of

struct Item {
  uint32_t key;
  uint32_t index;
};

struct Digit {
  int shift;
  uint32_t mask;

  [[nodiscard]] uint32_t Of(uint32_t key) const { return (key >> shift) & mask; }
};

struct KeyRange {
  uint32_t low = std::numeric_limits<uint32_t>::max();
  uint32_t high = 0;
  uint32_t varying = 0;  // bits in which some keys differ
};

KeyRange RangeOf(std::span<const uint32_t> keys) {
  std::vector<KeyRange> by_worker(WorkerCount(keys.size()));
  ParallelRanges(keys.size(), [&](const WorkRange& range) {
    KeyRange seen;
    for (size_t i = range.begin; i < range.end; ++i) {
      seen.low = std::min(seen.low, keys[i]);
      seen.high = std::max(seen.high, keys[i]);
      seen.varying |= keys[i] ^ keys[0];
    }
    by_worker[range.worker] = seen;
  });
  KeyRange all;
  for (const KeyRange& part : by_worker) {
    all.low = std::min(all.low, part.low);
    all.high = std::max(all.high, part.high);
    all.varying |= part.varying;
  }
  return all;
}

// Of keys less the lowest: as few digits as cover the bits that differ, all of about the same size,
// since small ones scatter faster.
std::vector<Digit> DigitsOf(const KeyRange& range) {
  if (range.varying == 0) return {};
  const int first = std::countr_zero(range.varying);
  const auto bits = static_cast<int>(std::bit_width(range.high - range.low)) - first;
  const int count = (bits + kMaxDigitBits - 1) / kMaxDigitBits;
  std::vector<Digit> digits;
  for (int d = 0; d < count; ++d) {
    const int begin = bits * d / count;
    const int end = bits * (d + 1) / count;
    digits.push_back({first + begin, (1U << (end - begin)) - 1U});
  }
  return digits;
}

// One pass: `read(i)` gives the items, `write(place, item)` takes them. Stable.
template <typename Read, typename Write>
void SortByDigit(size_t count, const Digit& digit, const Read& read, const Write& write) {
  // Count each worker's items by digit.
  std::vector<std::vector<uint32_t>> starts(WorkerCount(count));
  ParallelRanges(count, [&](const WorkRange& range) {
    std::vector<uint32_t> counts(digit.mask + 1, 0);
    const Digit local = digit;  // which no write below can change
    for (size_t i = range.begin; i < range.end; ++i) ++counts[local.Of(read(i).key)];
    starts[range.worker] = std::move(counts);
  });
  // Sum to the places where they begin: all of a digit together, earlier workers first.
  uint32_t start = 0;
  for (uint32_t value = 0; value <= digit.mask; ++value) {
    for (std::vector<uint32_t>& by_digit : starts) {
      start += std::exchange(by_digit[value], start);
    }
  }
  // Scatter.
  ParallelRanges(count, [&](const WorkRange& range) {
    const Digit local = digit;
    uint32_t* next = starts[range.worker].data();
    for (size_t i = range.begin; i < range.end; ++i) {
      const Item item = read(i);
      write(next[local.Of(item.key)]++, item);
    }
  });
}

}  // namespace

std::vector<uint32_t> SortedOrder(std::span<const uint32_t> keys) {
  const size_t count = keys.size();
  std::vector<uint32_t> order(count);
  if (count == 0) return order;
  const KeyRange range = RangeOf(keys);
  const std::vector<Digit> digits = DigitsOf(range);
  if (digits.empty()) {
    std::iota(order.begin(), order.end(), 0U);
    return order;
  }

  // The first pass reads the keys, the last one writes the order; between them are items.
  std::vector<Item> items(digits.size() > 1 ? count : 0);
  std::vector<Item> sorted(digits.size() > 2 ? count : 0);
  const auto read_key = [keys, low = range.low](size_t i) {
    return Item{keys[i] - low, static_cast<uint32_t>(i)};
  };
  const auto read_item = [&](size_t i) { return items[i]; };
  const auto write_order = [&](uint32_t place, const Item& item) { order[place] = item.index; };
  if (digits.size() == 1) {
    SortByDigit(count, digits[0], read_key, write_order);
    return order;
  }
  SortByDigit(count, digits[0], read_key,
              [&](uint32_t place, const Item& item) { items[place] = item; });
  for (size_t d = 1; d + 1 < digits.size(); ++d) {
    SortByDigit(count, digits[d], read_item,
                [&](uint32_t place, const Item& item) { sorted[place] = item; });
    items.swap(sorted);
  }
  SortByDigit(count, digits.back(), read_item, write_order);
  return order;
}

}  // namespace halflight
