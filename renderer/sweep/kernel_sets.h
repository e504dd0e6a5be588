// The sweep's kernels by instruction set.
#pragma once

#include <vector>

#include "renderer/sweep/kernels.h"

namespace halflight::sweep {

struct KernelSet {
  const char* name;
  const Kernels& kernels;
};

// Those that this CPU can run, the best first; the last one any CPU can.
std::vector<KernelSet> ListKernels();

}  // namespace halflight::sweep
