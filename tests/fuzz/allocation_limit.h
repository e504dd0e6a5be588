// Ends the program where more memory than allowed is held at once. Counts operator new in the whole
// process, which linking this replaces.
#pragma once

#include <cstddef>

namespace halflight::fuzz {

// As long as it lives, no more than `bytes` may be allocated beyond what was before. One at a time.
class AllocationLimit {
 public:
  explicit AllocationLimit(size_t bytes);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
  AllocationLimit(AllocationLimit&&) = delete;
  AllocationLimit& operator=(AllocationLimit&&) = delete;
};

}  // namespace halflight::fuzz
