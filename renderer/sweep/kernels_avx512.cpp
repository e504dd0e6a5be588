// The sweep's kernels for x86-64 with AVX-512; compiled for it alone, and called only where it is
// there. Includes nothing with functions of its own that other files might be linked to.
#include "renderer/sweep/kernels.h"

#include <cstddef>

#define HALFLIGHT_LANES 16
#include "renderer/sweep/simd.h"

// The blur goes over lines of eight floats: kernel_sets.cpp takes that of AVX2, and this one is
// never called.
namespace halflight::sweep::avx512 {
namespace {
[[noreturn]] void BlurLine(const BlurLineJob& /*job*/) { __builtin_trap(); }
}  // namespace
}  // namespace halflight::sweep::avx512

#define HALFLIGHT_KERNEL_SET avx512
#include "renderer/sweep/kernels.inc"
