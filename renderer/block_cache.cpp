#include "renderer/block_cache.h"

#include <sys/mman.h>

#include <algorithm>
#include <bit>
#include <mutex>

namespace halflight {

namespace {

constexpr size_t kCacheLine = 64;
constexpr size_t kHugePage = size_t{2} << 20U;

struct Idle {
  void* block;
  size_t bytes;
};

struct Cache {
  std::mutex mutex;
  std::vector<Idle> idle;  // guarded by mutex, as the rest; idle longest first
  size_t bytes = 0;
  size_t limit = size_t{1} << 30U;
};

// Never destroyed: arrays of static storage may be freed later.
Cache& TheCache() {
  static Cache& cache = *new Cache;
  return cache;
}

// Eight sizes from each power of two to the next. `bytes` is at least kLeastBytes.
size_t RoundedUp(size_t bytes) {
  const size_t step = std::max<size_t>(std::bit_floor(bytes) / 8, 1);
  return (bytes + step - 1) / step * step;
}

std::align_val_t AlignmentOf(size_t bytes) {
  return std::align_val_t{bytes >= 2 * kHugePage ? kHugePage : kCacheLine};
}

void* NewBlock(size_t bytes) {
  void* const block = ::operator new(bytes, AlignmentOf(bytes));
  // A hint: where the system has no huge pages, small ones serve.
  if (AlignmentOf(bytes) == std::align_val_t{kHugePage}) madvise(block, bytes, MADV_HUGEPAGE);
  return block;
}

// Takes those idle longest until at most `limit` bytes are left.
std::vector<Idle> TakeDownTo(size_t limit, Cache& cache) {
  size_t count = 0;
  for (; cache.bytes > limit; ++count) cache.bytes -= cache.idle[count].bytes;
  const auto end = cache.idle.begin() + static_cast<ptrdiff_t>(count);
  std::vector<Idle> taken(cache.idle.begin(), end);
  cache.idle.erase(cache.idle.begin(), end);
  return taken;
}

void FreeAll(const std::vector<Idle>& blocks) {
  for (const Idle& idle : blocks) ::operator delete(idle.block, AlignmentOf(idle.bytes));
}

void FreeDownTo(size_t limit) {
  std::vector<Idle> taken;
  {
    Cache& cache = TheCache();
    const std::lock_guard lock(cache.mutex);
    taken = TakeDownTo(limit, cache);
  }
  FreeAll(taken);
}

}  // namespace

void BlockCache::SetLimit(size_t bytes) {
  {
    Cache& cache = TheCache();
    const std::lock_guard lock(cache.mutex);
    cache.limit = bytes;
  }
  FreeDownTo(bytes);
}

void BlockCache::Release() { FreeDownTo(0); }

size_t BlockCache::idle_bytes() {
  Cache& cache = TheCache();
  const std::lock_guard lock(cache.mutex);
  return cache.bytes;
}

void* BlockCache::Allocate(size_t bytes) {
  if (bytes < kLeastBytes) return ::operator new(bytes);
  bytes = RoundedUp(bytes);
  {
    Cache& cache = TheCache();
    const std::lock_guard lock(cache.mutex);
    // The one freed last: it is the likeliest to be in the processor's caches.
    const auto found = std::find_if(cache.idle.rbegin(), cache.idle.rend(),
                                    [bytes](const Idle& idle) { return idle.bytes == bytes; });
    if (found != cache.idle.rend()) {
      void* const block = found->block;
      cache.bytes -= bytes;
      cache.idle.erase(std::next(found).base());
      return block;
    }
  }
  return NewBlock(bytes);
}

void BlockCache::Free(void* block, size_t bytes) noexcept {
  if (bytes < kLeastBytes) {
    ::operator delete(block);
    return;
  }
  bytes = RoundedUp(bytes);
  std::vector<Idle> taken;
  {
    Cache& cache = TheCache();
    const std::lock_guard lock(cache.mutex);
    cache.idle.push_back({block, bytes});
    cache.bytes += bytes;
    taken = TakeDownTo(cache.limit, cache);
  }
  FreeAll(taken);
}

}  // namespace halflight
