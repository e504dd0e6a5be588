#include "renderer/sweep/kernel_sets.h"

namespace halflight::sweep {

// Each defined by the file that is compiled for it.
#if defined(__x86_64__)
namespace avx2 {
extern const Kernels kKernels;
}
namespace avx512 {
extern const Kernels kKernels;
}
#endif
namespace baseline {
extern const Kernels kKernels;
}

std::vector<KernelSet> ListKernels() {
  std::vector<KernelSet> sets;
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") &&
                      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512bw");
  // Its blur is that of AVX2, as kernels_avx512.cpp says.
  static const Kernels avx512_kernels = [] {
    Kernels kernels = avx512::kKernels;
    kernels.blur_line = avx2::kKernels.blur_line;
    return kernels;
  }();
  if (avx512) sets.push_back({"Avx512", avx512_kernels});
  if (avx2) sets.push_back({"Avx2", avx2::kKernels});
#endif
  sets.push_back({"Baseline", baseline::kKernels});
  return sets;
}

const Kernels& BestKernels() {
  static const Kernels& best = ListKernels().front().kernels;
  return best;
}

}  // namespace halflight::sweep
