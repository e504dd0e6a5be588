// Raster draws in pieces, for CPU rasterisers: those take every command at once, and may then be at
// it for minutes, whatever became of the frame. Says nothing of compute, whose dispatches they
// finish one by one, and leaves GPUs alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include <glm/vec2.hpp>

#include "absl/status/status.h"
#include "renderer/gl/object.h"
#include "renderer/gl/staging.h"

namespace halflight {

// What the quads of an order cost to draw, in fragments, place by place.
using QuadCosts = std::vector<float>;

// One for all frames of a context, which is current whenever it is called.
class RasterPieces {
 public:
  // Fragments of a piece, unless a single quad has more: two slow cores took 10 ms for them without
  // shadows, and 45 ms with eight lights whose light varies from place to place.
  static constexpr double kMostCost = 0x1p20;

  // `software`: whether the device is a CPU rasteriser; on others nothing is cut.
  explicit RasterPieces(bool software) : software_(software) {}

  // Of the splats that ProjectParticles left for a target of `size` pixels. Waits for them.
  [[nodiscard]] QuadCosts CostsOf(const gl::Buffer& splats, size_t count,
                                  const glm::ivec2& size) const;

  // Draws places [begin, end) by calls of `draw` for consecutive ranges, as few as may be. While a
  // piece is recorded no more than the one before it is still drawn, and small draws share a piece
  // without waiting for anything. Cancelled when `stop` says so after a piece.
  absl::Status Draw(const QuadCosts& costs, uint32_t begin, uint32_t end,
                    const std::stop_token& stop,
                    const std::function<absl::Status(uint32_t, uint32_t)>& draw);

  // How many pieces have been ended so far.
  [[nodiscard]] uint64_t ended() const { return ended_; }

 private:
  // The first place behind the piece that goes on with `begin`.
  uint32_t TakeUpTo(const QuadCosts& costs, uint32_t begin, uint32_t end);
  void EndPiece();

  bool software_;
  double cost_ = 0.0;  // of the piece so far
  gl::Fence before_;   // behind the piece before
  uint64_t ended_ = 0;
};

}  // namespace halflight
