#version 450
#extension GL_GOOGLE_include_directive : require
// Counts the items of each digit in each block.
#include "bindings.h"
#include "sort.glsl"

layout(std430, binding = kSortTableBinding) writeonly buffer Table { uint table[]; };

shared uint counts[kSortGroupSize];

void main() {
  if (WorkgroupIndex() >= sort.pass.z) return;
  counts[gl_LocalInvocationIndex] = 0u;
  barrier();
  for (uint round = 0u; round < kSortRounds; ++round) {
    uint item = ItemOf(round);
    if (item < sort.pass.x) atomicAdd(counts[DigitOf(keys[item])], 1u);
  }
  barrier();
  table[TableEntry(gl_LocalInvocationIndex)] = counts[gl_LocalInvocationIndex];
}
