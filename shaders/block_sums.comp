#version 450
#extension GL_GOOGLE_include_directive : require
// Sums each workgroup's block of values: sums[b] = sum of values[kScanBlock * b + j].
#include "bindings.h"
#include "scan.glsl"

layout(std430, binding = kScanValuesBinding) readonly buffer Values { uint values[]; };
layout(std430, binding = kScanBlockSumsBinding) writeonly buffer Sums { uint sums[]; };

void main() {
  if (WorkgroupIndex() >= scan.blocks.x) return;
  uint first = FirstValue();
  uint sum = 0u;
  for (uint j = 0u; j < kScanPerInvocation; ++j) {
    if (first + j < scan.count.x) sum = AddUpToLargest(sum, values[first + j]);
  }
  sum = AddUpToLargest(SumBeforeThis(sum), sum);
  if (gl_LocalInvocationIndex == kScanGroupSize - 1u) sums[scan.blocks.y + WorkgroupIndex()] = sum;
}
