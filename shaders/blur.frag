#version 450
#extension GL_GOOGLE_include_directive : require
// One axis of the light's spread between two slices. Light spreads, not optical depth, so the
// kernel weighs transmittance; the buffer stays in optical depth:
//   D' = m - log(sum of weight * exp(-density (D - m))) / density,   m = least D under the kernel
// Beyond the buffer light is unattenuated. Blending: off.
#include "bindings.h"

layout(constant_id = kColoredLightBufferConstant) const bool kColoredLightBuffer = false;

layout(std140, binding = kBlurBinding) uniform Blur { BlurBlock blur; };
layout(binding = kSourceBinding) uniform sampler2D source;
layout(location = 0) out vec4 blurred;

vec3 Fetch(int distance_from_centre) {
  ivec2 texel = ivec2(gl_FragCoord.xy) + distance_from_centre * ivec2(blur.axis.xy);
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, textureSize(source, 0)))) {
    return vec3(0.0);
  }
  vec4 value = texelFetch(source, texel, 0);
  return kColoredLightBuffer ? value.rgb : value.rrr;
}

void main() {
  int radius = int(blur.axis.z);
  vec3 least = Fetch(0);
  vec3 centre = least;
  for (int d = 1; d <= radius; ++d) least = min(least, min(Fetch(d), Fetch(-d)));

  vec3 sum = vec3(0.0);
  for (int d = -radius; d <= radius; ++d) {
    float weight = blur.weights[abs(d) >> 2][abs(d) & 3];
    sum += weight * exp(-blur.density.rgb * (Fetch(d) - least));
  }
  vec3 result = least - log(sum) / max(blur.density.rgb, 1e-30);
  blurred = vec4(mix(centre, max(result, 0.0), greaterThan(blur.density.rgb, vec3(0.0))), 0.0);
}
