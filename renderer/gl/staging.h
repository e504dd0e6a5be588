// Main memory that the device writes while others read: what it takes to read back without waiting.
// All calls need the context current on this thread, destructors included.
#pragma once

#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

#include "renderer/gl/object.h"

namespace halflight::gl {

// A point in the commands given so far.
class Fence {
 public:
  Fence() = default;  // one that has been passed
  Fence(Fence&& other) noexcept : sync_(std::exchange(other.sync_, nullptr)) {}
  Fence& operator=(Fence&& other) noexcept {
    std::swap(sync_, other.sync_);
    return *this;
  }
  Fence(const Fence&) = delete;
  Fence& operator=(const Fence&) = delete;
  ~Fence() {
    if (sync_ != nullptr) glDeleteSync(sync_);
  }

  // After all commands so far, which the device begins to work on now.
  static Fence Insert();

  // Waits for the device, at most for so long. Where waiting fails it is passed, with a GL error.
  [[nodiscard]] bool Passed(std::chrono::nanoseconds wait) const;

 private:
  GLsync sync_ = nullptr;
};

// Blocks of main memory, mapped for as long as they are there and reused from frame to frame.
class StagingMemory {
 public:
  struct Block {
    Buffer buffer;
    const std::byte* contents = nullptr;  // null where there was no memory: a GL error tells
    size_t bytes = 0;
  };
  // Blocks that wait to be used again, together at most: what was given back first goes first.
  static constexpr size_t kMostIdleBytes = size_t{256} << 20U;

  // At least `bytes`; contents are anything. Commands that write it may be given at once, since the
  // device keeps their order; they are there to be read after a fence behind them has passed.
  Block Take(size_t bytes);
  void GiveBack(Block block);
  void Clear();

  [[nodiscard]] size_t idle_bytes() const { return idle_bytes_; }
  // How many blocks had to be made.
  [[nodiscard]] size_t blocks_made() const { return blocks_made_; }

 private:
  std::vector<Block> idle_;  // given back last at the end
  size_t idle_bytes_ = 0;
  size_t blocks_made_ = 0;
};

}  // namespace halflight::gl
