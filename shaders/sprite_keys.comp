#version 450
#extension GL_GOOGLE_include_directive : require
// The sort key of every particle: its depth along an orthographic target's axis, else its squared
// distance from the eye.
#include "bindings.h"
#include "sprites.glsl"

layout(std430, binding = kSpriteKeysBinding) writeonly buffer Keys { uint keys[]; };

// OrderedKey() of renderer/sort.h.
uint OrderedKey(float value) {
  uint bits = floatBitsToUint(value);
  if (bits == 0x80000000u) bits = 0u;
  return (bits >> 31u) != 0u ? ~bits : bits | 0x80000000u;
}

void main() {
  uint i = InvocationIndex();
  if (i >= particles.count.x) return;
  dvec3 view = ViewOf(i);
  precise double distance_squared = view.x * view.x + view.y * view.y + view.z * view.z;
  double depth = kOrthographic ? -view.z : distance_squared;
  keys[i] = OrderedKey(float(depth));
}
