#version 450
#extension GL_GOOGLE_include_directive : require
// One axis of the light's spread between two slices. Light spreads, not optical depth, so the
// kernel weighs transmittance; the buffer stays in optical depth, so that deep shadows do not
// underflow and faint ones do not drown in the rounding of 1 - D:
//   D' = m - log(sum of weight * exp(-density (D - m))) / density,   m = least D under the kernel
// Beyond the buffer light is unattenuated. Blending: off.
#include "bindings.h"
#include "opacity.glsl"

layout(constant_id = kColoredLightBufferConstant) const bool kColoredLightBuffer = false;

const int kChannels = kColoredLightBuffer ? 3 : 1;

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

  // Light kept and light lost: which of the two has the digits depends on the shadow's depth.
  vec3 kept = vec3(0.0);
  vec3 lost = vec3(0.0);
  for (int d = -radius; d <= radius; ++d) {
    vec3 weight = blur.weights[abs(d)].rgb;
    vec3 depth = blur.density.rgb * (Fetch(d) - least);
    for (int c = 0; c < kChannels; ++c) {
      float opacity = OpacityFromOpticalDepth(depth[c]);
      lost[c] += weight[c] * opacity;
      kept[c] += weight[c] * (depth[c] < 1.0 ? 1.0 - opacity : exp(-depth[c]));
    }
  }
  blurred = vec4(0.0);
  for (int c = 0; c < kChannels; ++c) {
    float density = blur.density[c];
    // A colour that nothing attenuates needs no spreading.
    blurred[c] = density > 0.0
                     ? least[c] + OpticalDepthFromOpacity(lost[c], kept[c]) / density
                     : centre[c];
  }
}
