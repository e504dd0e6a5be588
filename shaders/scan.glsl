// Prefix sums within one workgroup of kScanGroupSize invocations, and how its values are dealt out.
// Sums end at the largest number instead of wrapping around. Included after bindings.h.
#include "workgroup.glsl"

layout(local_size_x = kScanGroupSize) in;

layout(std140, binding = kScanBinding) uniform Scan { ScanBlock scan; };

shared uint group_sums[2][kScanGroupSize];

uint AddUpToLargest(uint a, uint b) {
  uint sum = a + b;
  return sum < a ? 0xFFFFFFFFu : sum;
}

// The sum of `value` over the invocations before this one. Hillis and Steele 1986, "Data Parallel
// Algorithms": each step doubles how far back an invocation has summed.
uint SumBeforeThis(uint value) {
  uint i = gl_LocalInvocationIndex;
  uint now = 0u;
  group_sums[0][i] = value;
  barrier();
  for (uint back = 1u; back < kScanGroupSize; back *= 2u) {
    uint sum = group_sums[now][i];
    if (i >= back) sum = AddUpToLargest(group_sums[now][i - back], sum);
    now = 1u - now;
    group_sums[now][i] = sum;
    barrier();
  }
  return i > 0u ? group_sums[now][i - 1u] : 0u;
}

// Where this invocation's kScanPerInvocation values begin.
uint FirstValue() {
  return (WorkgroupIndex() * kScanGroupSize + gl_LocalInvocationIndex) * kScanPerInvocation;
}
