// Memory for a frame's large arrays, kept between frames: fresh pages from the system cost a third
// of a light sweep's frame. Small arrays go to the heap as ever.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace halflight {

// Blocks that were given back and wait to be used again, of the whole process. Any thread.
class BlockCache {
 public:
  // Smaller requests are the heap's.
  static constexpr size_t kLeastBytes = size_t{256} << 10U;

  // At most `bytes` of idle blocks stay; what has been idle longest goes first. 1 GiB at first.
  static void SetLimit(size_t bytes);
  // Gives all idle blocks back to the system.
  static void Release();
  static size_t idle_bytes();

  // Contents are anything. Takes up to an eighth more than asked, so that a block serves requests
  // of about its size. Aligned to 64 bytes; bad_alloc when the system has no more.
  static void* Allocate(size_t bytes);
  static void Free(void* block, size_t bytes) noexcept;
};

// Leaves new elements of trivial types as they come, so that nothing is written twice.
template <typename T>
class BlockAllocator {
 public:
  using value_type = T;

  BlockAllocator() = default;
  template <typename U>
  BlockAllocator(const BlockAllocator<U>& /*other*/) {}  // NOLINT(google-explicit-constructor)

  T* allocate(size_t count) {
    if (count > std::numeric_limits<size_t>::max() / sizeof(T)) throw std::bad_array_new_length();
    return static_cast<T*>(BlockCache::Allocate(count * sizeof(T)));
  }
  void deallocate(T* block, size_t count) noexcept { BlockCache::Free(block, count * sizeof(T)); }

  template <typename U, typename... Args>
  void construct(U* at, Args&&... args) {
    if constexpr (sizeof...(Args) == 0 && std::is_trivially_copyable_v<U>) {
      ::new (static_cast<void*>(at)) U;
    } else {
      ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
    }
  }

  friend bool operator==(const BlockAllocator& /*a*/, const BlockAllocator& /*b*/) { return true; }
};

// A vector of one of a frame's large arrays. resize() leaves new elements uninitialised where their
// type has no initialisers of its own: assign() zeroes.
template <typename T>
using Block = std::vector<T, BlockAllocator<T>>;

}  // namespace halflight
