// In place of yardstick.cpp on machines that have no AVX2.
#include "absl/status/status.h"
#include "tests/bench/yardstick.h"

namespace halflight::bench {

struct Yardstick::Buffers {};

Yardstick::Yardstick() = default;
Yardstick::Yardstick(Yardstick&&) noexcept = default;
Yardstick& Yardstick::operator=(Yardstick&&) noexcept = default;
Yardstick::~Yardstick() = default;

bool Yardstick::Runs() { return false; }

absl::StatusOr<FrameResult> Yardstick::Draw(const FrameRequest&) {
  return absl::UnimplementedError("yardstick: written for x86-64");
}

}  // namespace halflight::bench
