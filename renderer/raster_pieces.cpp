#include "renderer/raster_pieces.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include <glm/common.hpp>

#include "shaders/bindings.h"

namespace halflight {

namespace {

// Fragments that take as long as setting up a quad that has none.
constexpr float kQuadCost = 256.0F;

// Half a MiB of them: what a core has near it.
constexpr size_t kSplatsOfARead = (size_t{1} << 19U) / sizeof(shader::Splat);

float CostOf(const glm::vec4& rect, const glm::vec2& size) {
  const glm::vec2 low = glm::clamp(glm::vec2(rect.x, rect.y), glm::vec2(0.0F), size);
  const glm::vec2 high = glm::clamp(glm::vec2(rect.z, rect.w), low, size);
  return kQuadCost + (high.x - low.x) * (high.y - low.y);
}

void Wait(const gl::Fence& fence) {
  while (!fence.Passed(std::chrono::seconds(1))) {
  }
}

}  // namespace

QuadCosts RasterPieces::CostsOf(const gl::Buffer& splats, size_t count,
                                const glm::ivec2& size) const {
  if (!software_ || count == 0) return {};
  QuadCosts costs;
  costs.reserve(count);
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  std::vector<shader::Splat> read(std::min(count, kSplatsOfARead));
  for (size_t first = 0; first < count; first += read.size()) {
    read.resize(std::min(read.size(), count - first));
    glGetNamedBufferSubData(splats.name(), static_cast<GLintptr>(first * sizeof(shader::Splat)),
                            static_cast<GLsizeiptr>(read.size() * sizeof(shader::Splat)),
                            read.data());
    for (const shader::Splat& splat : read) costs.push_back(CostOf(splat.rect, size));
  }
  return costs;
}

uint32_t RasterPieces::TakeUpTo(const QuadCosts& costs, uint32_t begin, uint32_t end) {
  uint32_t k = begin;
  while (k < end && cost_ < kMostCost) cost_ += costs[k++];
  return k;
}

void RasterPieces::EndPiece() {
  gl::Fence fence = gl::Fence::Insert();
  Wait(before_);
  // Nothing is recorded behind a single quad that takes longer than a piece may.
  if (cost_ > 2 * kMostCost) Wait(fence);
  before_ = std::move(fence);
  cost_ = 0.0;
  ++ended_;
}

absl::Status RasterPieces::Draw(const QuadCosts& costs, uint32_t begin, uint32_t end,
                                const std::stop_token& stop,
                                const std::function<absl::Status(uint32_t, uint32_t)>& draw) {
  if (!software_) return draw(begin, end);
  while (begin < end) {
    const uint32_t up_to = TakeUpTo(costs, begin, end);
    if (absl::Status status = draw(begin, up_to); !status.ok()) return status;
    begin = up_to;
    if (cost_ < kMostCost) continue;
    EndPiece();
    if (stop.stop_requested()) return absl::CancelledError("frame cancelled");
  }
  return absl::OkStatus();
}

}  // namespace halflight
