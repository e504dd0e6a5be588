// The sweep's kernels for x86-64 with AVX-512; compiled for it alone, and called only where it is
// there. Includes nothing with functions of its own that other files might be linked to.
#include "renderer/sweep/kernels.h"

#include <cstddef>

#define HALFLIGHT_LANES 16
#include "renderer/sweep/simd.h"

#define HALFLIGHT_KERNEL_SET avx512
#include "renderer/sweep/kernels.inc"
