// The sweep's kernels for x86-64 with AVX2 and FMA; compiled for these alone, and called only where
// they are there. Includes nothing with functions of its own that other files might be linked to.
#include "renderer/sweep/kernels.h"

#include <cstddef>

#include "renderer/sweep/simd.h"

#define HALFLIGHT_KERNEL_SET avx2
#include "renderer/sweep/blur_kernel.inc"
#include "renderer/sweep/kernels.inc"
