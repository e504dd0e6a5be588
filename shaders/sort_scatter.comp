#version 450
#extension GL_GOOGLE_include_directive : require
// Moves each item to its place by one digit: where its digit begins in its block, plus how many
// items of that digit come before it there. Stable, and the same every time: of each digit the
// invocations that have it in a round are a set of bits, so that no order of execution shows.
#include "bindings.h"
#include "sort.glsl"

// Whether values are the items' numbers, and none are read.
layout(constant_id = kNumberItemsConstant) const bool kNumberItems = false;

layout(std430, binding = kSortTableBinding) readonly buffer Table { uint table[]; };
layout(std430, binding = kSortValuesBinding) readonly buffer Values { uint values[]; };
layout(std430, binding = kSortedKeysBinding) writeonly buffer SortedKeys { uint sorted_keys[]; };
layout(std430, binding = kSortedValuesBinding) writeonly buffer SortedValues {
  uint sorted_values[];
};

const uint kWords = kSortGroupSize / 32u;

shared uint next[kSortGroupSize];             // where a digit's next item goes
shared uint having[kWords * kSortGroupSize];  // word by word: the invocations that have a digit

void main() {
  if (WorkgroupIndex() >= sort.pass.z) return;
  uint self = gl_LocalInvocationIndex;
  uint word = self / 32u;
  uint bit = 1u << (self % 32u);
  next[self] = table[TableEntry(self)];
  for (uint w = 0u; w < kWords; ++w) having[w * kSortGroupSize + self] = 0u;
  barrier();

  for (uint round = 0u; round < kSortRounds; ++round) {
    uint item = ItemOf(round);
    bool valid = item < sort.pass.x;
    uint key = valid ? keys[item] : 0u;
    uint digit = DigitOf(key);
    if (valid) atomicOr(having[word * kSortGroupSize + digit], bit);
    barrier();

    if (valid) {
      uint before = bitCount(having[word * kSortGroupSize + digit] & (bit - 1u));
      for (uint w = 0u; w < word; ++w) before += bitCount(having[w * kSortGroupSize + digit]);
      uint place = next[digit] + before;
      sorted_keys[place] = key;
      sorted_values[place] = kNumberItems ? item : values[item];
    }
    barrier();

    uint count = 0u;
    for (uint w = 0u; w < kWords; ++w) {
      count += bitCount(having[w * kSortGroupSize + self]);
      having[w * kSortGroupSize + self] = 0u;
    }
    next[self] += count;
    barrier();
  }
}
