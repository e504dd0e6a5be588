#version 450
#extension GL_GOOGLE_include_directive : require
// Exclusive prefix sums of each workgroup's block: prefix[k] = before[block] + the sum of the
// block's values before k. May write where it reads: an invocation writes only what it alone reads,
// and only afterwards.
#include "bindings.h"
#include "scan.glsl"

layout(std430, binding = kScanValuesBinding) readonly buffer Values { uint values[]; };
layout(std430, binding = kScanBlockSumsBinding) readonly buffer Before { uint before[]; };
layout(std430, binding = kScanPrefixBinding) writeonly buffer Prefix { uint prefix[]; };

void main() {
  if (WorkgroupIndex() >= scan.blocks.x) return;
  uint first = FirstValue();
  uint mine[kScanPerInvocation];
  uint sum = 0u;
  for (uint j = 0u; j < kScanPerInvocation; ++j) {
    mine[j] = first + j < scan.count.x ? values[first + j] : 0u;
    sum = AddUpToLargest(sum, mine[j]);
  }
  uint at = AddUpToLargest(before[scan.blocks.y + WorkgroupIndex()], SumBeforeThis(sum));
  for (uint j = 0u; j < kScanPerInvocation; ++j) {
    if (first + j < scan.count.y) prefix[first + j] = at;
    at = AddUpToLargest(at, mine[j]);
  }
}
