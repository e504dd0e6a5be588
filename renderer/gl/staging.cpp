#include "renderer/gl/staging.h"

#include <algorithm>

namespace halflight::gl {

namespace {

// Read by the CPU alone; what the device wrote before a fence is seen behind it without barriers.
constexpr GLbitfield kMapping = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;

StagingMemory::Block MakeBlock(size_t bytes) {
  StagingMemory::Block block{MakeBuffer("readback", bytes, kMapping | GL_CLIENT_STORAGE_BIT),
                             nullptr, bytes};
  block.contents = static_cast<const std::byte*>(
      glMapNamedBufferRange(block.buffer.name(), 0, static_cast<GLsizeiptr>(bytes), kMapping));
  return block;
}

}  // namespace

Fence Fence::Insert() {
  Fence fence;
  fence.sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  glFlush();
  return fence;
}

bool Fence::Passed(std::chrono::nanoseconds wait) const {
  if (sync_ == nullptr) return true;
  return glClientWaitSync(sync_, 0, static_cast<GLuint64>(wait.count())) != GL_TIMEOUT_EXPIRED;
}

StagingMemory::Block StagingMemory::Take(size_t bytes) {
  auto best = idle_.end();
  for (auto block = idle_.begin(); block != idle_.end(); ++block) {
    if (block->bytes >= bytes && (best == idle_.end() || block->bytes < best->bytes)) best = block;
  }
  if (best == idle_.end()) {
    ++blocks_made_;
    return MakeBlock(bytes);
  }
  Block block = std::move(*best);
  idle_.erase(best);
  idle_bytes_ -= block.bytes;
  return block;
}

void StagingMemory::GiveBack(Block block) {
  if (block.contents == nullptr || block.bytes > kMostIdleBytes) return;
  idle_bytes_ += block.bytes;
  idle_.push_back(std::move(block));
  while (idle_bytes_ > kMostIdleBytes) {
    idle_bytes_ -= idle_.front().bytes;
    idle_.erase(idle_.begin());
  }
}

void StagingMemory::Clear() {
  idle_.clear();
  idle_bytes_ = 0;
}

}  // namespace halflight::gl
