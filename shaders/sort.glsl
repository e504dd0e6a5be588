// How items and digits of a radix sort are dealt out. Included after bindings.h.
#include "workgroup.glsl"

// Invocation k serves item kSortGroupSize * r + k of its block in round r, and digit k: as many
// digits as invocations.
layout(local_size_x = kSortGroupSize) in;

layout(std140, binding = kSortBinding) uniform Sort { SortBlock sort; };
layout(std430, binding = kSortKeysBinding) readonly buffer Keys { uint keys[]; };

uint ItemOf(uint round) {
  return (WorkgroupIndex() * kSortRounds + round) * kSortGroupSize + gl_LocalInvocationIndex;
}

uint DigitOf(uint key) { return (key >> sort.pass.y) & (kSortGroupSize - 1u); }

// In the table of counts, and of the starts that they sum to: digit by digit, so that all items of
// a digit lie together, earlier blocks first.
uint TableEntry(uint digit) { return digit * sort.pass.z + WorkgroupIndex(); }
