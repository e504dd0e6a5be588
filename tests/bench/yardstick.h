// The SIMD yardstick: one frame of smoke drawn by hand with AVX2, to show what the machine can do.
// No generality: one radius and opacity, one directional light, one shadow value a particle (the
// weighted mean over its footprint, the light sweep's degree 0), nothing kept between frames. Uses
// nothing of the renderer's paths, so that it changes with none of them.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "renderer/frame.h"

namespace halflight::bench {

class Yardstick {
 public:
  // Whether this CPU has AVX2 and FMA.
  static bool Runs();

  Yardstick();
  Yardstick(Yardstick&&) noexcept;
  Yardstick& operator=(Yardstick&&) noexcept;
  Yardstick(const Yardstick&) = delete;
  Yardstick& operator=(const Yardstick&) = delete;
  ~Yardstick();

  // The beauty, with timings by stage. Uses all cores. InvalidArgument, naming the field, for what
  // is not in its class; Unimplemented where it does not run.
  absl::StatusOr<FrameResult> Draw(const FrameRequest& request);

 private:
  struct Buffers;
  class Frame;
  std::unique_ptr<Buffers> buffers_;  // kept for their memory alone
};

}  // namespace halflight::bench
