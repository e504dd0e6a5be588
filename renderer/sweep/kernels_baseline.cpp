// The sweep's kernels for every machine.
#include "renderer/sweep/kernels.h"

#include <cstddef>

#include "renderer/sweep/simd.h"

#define HALFLIGHT_KERNEL_SET baseline
#include "renderer/sweep/blur_kernel.inc"
#include "renderer/sweep/kernels.inc"

#if defined(__x86_64__)
namespace halflight::sweep::avx2 {
extern const Kernels kKernels;
}
#endif

namespace halflight::sweep {

const Kernels& BestKernels() {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2) return avx2::kKernels;
#endif
  return baseline::kKernels;
}

const Kernels& BaselineKernels() { return baseline::kKernels; }

}  // namespace halflight::sweep
