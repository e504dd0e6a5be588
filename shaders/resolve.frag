#version 450
#extension GL_GOOGLE_include_directive : require
// From composited samples to the image's pixels: the mean of n x n samples, or, enlarging, bilinear
// interpolation between samples n pixels apart. Places are counted in the whole image, so that a
// band shows what the whole would. Premultiplied in, premultiplied out. Blending: off.
#include "bindings.h"

layout(constant_id = kEnlargeConstant) const bool kEnlarge = false;

layout(std140, binding = kResolveBinding) uniform Resolve { ResolveBlock resolve; };
layout(binding = kSourceBinding) uniform sampler2D source;
layout(location = 0) out vec4 pixel;

vec4 SampleAt(ivec2 at) {
  return texelFetch(source, clamp(at, ivec2(0), resolve.size.xy - 1) - resolve.first.zw, 0);
}

void main() {
  int n = resolve.factor.x;
  ivec2 place = ivec2(gl_FragCoord.xy) + resolve.first.xy;
  if (kEnlarge) {
    vec2 at = (vec2(place) + 0.5) / float(n) - 0.5;
    vec2 low = floor(at);
    ivec2 corner = ivec2(low);
    vec2 t = at - low;
    pixel = mix(mix(SampleAt(corner), SampleAt(corner + ivec2(1, 0)), t.x),
                mix(SampleAt(corner + ivec2(0, 1)), SampleAt(corner + 1), t.x), t.y);
    return;
  }
  vec4 sum = vec4(0.0);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) sum += SampleAt(place * n + ivec2(x, y));
  }
  pixel = sum / float(n * n);
}
