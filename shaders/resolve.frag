#version 450
#extension GL_GOOGLE_include_directive : require
// From composited samples to the image's pixels: the mean of n x n samples, or, enlarging, bilinear
// interpolation between samples n pixels apart. Premultiplied in, premultiplied out. Blending: off.
#include "bindings.h"

layout(constant_id = kEnlargeConstant) const bool kEnlarge = false;

layout(std140, binding = kResolveBinding) uniform Resolve { ResolveBlock resolve; };
layout(binding = kSourceBinding) uniform sampler2D source;
layout(location = 0) out vec4 pixel;

void main() {
  int n = int(resolve.factor.x);
  if (kEnlarge) {
    pixel = texture(source, gl_FragCoord.xy / float(n) / vec2(textureSize(source, 0)));
    return;
  }
  ivec2 corner = ivec2(gl_FragCoord.xy) * n;
  vec4 sum = vec4(0.0);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) sum += texelFetch(source, corner + ivec2(x, y), 0);
  }
  pixel = sum / float(n * n);
}
