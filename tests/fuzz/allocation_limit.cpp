#include "tests/fuzz/allocation_limit.h"

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <new>

#include <malloc.h>

namespace {

constexpr size_t kUnlimited = std::numeric_limits<size_t>::max();
std::atomic<size_t> held = 0;
std::atomic<size_t> allowed = kUnlimited;

// `bytes` are asked for. Looked at before they are taken, so that gigabytes are never touched.
void* Allocate(size_t bytes, size_t alignment) {
  const size_t limit = allowed;
  if (limit != kUnlimited && (bytes > limit || held > limit - bytes)) {
    allowed = kUnlimited;
    std::fprintf(stderr, "does not hold: %zu bytes more than the %zu held are within %zu\n", bytes,
                 held.load(), limit);
    std::abort();
  }
  void* const memory =
      alignment <= __STDCPP_DEFAULT_NEW_ALIGNMENT__
          ? std::malloc(bytes)
          : std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (memory == nullptr) {
    std::abort();
  }
  held += malloc_usable_size(memory);
  return memory;
}

void Free(void* memory) {
  held -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

// All of them: a sanitizer's own would not do with the others.
void* operator new(size_t bytes) { return Allocate(bytes, 0); }
void* operator new[](size_t bytes) { return Allocate(bytes, 0); }
void* operator new(size_t bytes, const std::nothrow_t& /*tag*/) noexcept {
  return Allocate(bytes, 0);
}
void* operator new[](size_t bytes, const std::nothrow_t& /*tag*/) noexcept {
  return Allocate(bytes, 0);
}
void* operator new(size_t bytes, std::align_val_t alignment) {
  return Allocate(bytes, static_cast<size_t>(alignment));
}
void* operator new[](size_t bytes, std::align_val_t alignment) {
  return Allocate(bytes, static_cast<size_t>(alignment));
}
void operator delete(void* memory) noexcept { Free(memory); }
void operator delete[](void* memory) noexcept { Free(memory); }
void operator delete(void* memory, const std::nothrow_t& /*tag*/) noexcept { Free(memory); }
void operator delete[](void* memory, const std::nothrow_t& /*tag*/) noexcept { Free(memory); }
void operator delete(void* memory, size_t /*bytes*/) noexcept { Free(memory); }
void operator delete[](void* memory, size_t /*bytes*/) noexcept { Free(memory); }
void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept { Free(memory); }
void operator delete[](void* memory, std::align_val_t /*alignment*/) noexcept { Free(memory); }
void operator delete(void* memory, size_t /*bytes*/, std::align_val_t /*alignment*/) noexcept {
  Free(memory);
}
void operator delete[](void* memory, size_t /*bytes*/, std::align_val_t /*alignment*/) noexcept {
  Free(memory);
}

namespace halflight::fuzz {

AllocationLimit::AllocationLimit(size_t bytes) { allowed = held + bytes; }
AllocationLimit::~AllocationLimit() { allowed = kUnlimited; }

}  // namespace halflight::fuzz
