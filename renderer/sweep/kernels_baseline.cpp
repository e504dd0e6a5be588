// The sweep's kernels for every machine.
#include "renderer/sweep/kernels.h"

#include <cstddef>

#include "renderer/sweep/simd.h"

#define HALFLIGHT_KERNEL_SET baseline
#include "renderer/sweep/blur_kernel.inc"
#include "renderer/sweep/kernels.inc"
