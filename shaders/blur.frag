#version 450
#extension GL_GOOGLE_include_directive : require
// One axis of the light's spread between two slices. Light spreads, not optical depth, so the
// kernel weighs transmittance; the buffer stays in optical depth, so that deep shadows do not
// underflow and faint ones do not drown in the rounding of 1 - D:
//   D' = m - log(sum of weight * exp(-density (D - m))) / density,   m = least D under the kernel
// Where the buffer also holds the optical depth U >= D of unscattered light, that light stays where
// it is, and only the rest of the transmittance spreads:
//   D' = m - log(exp(-density (U - m))
//                + sum of weight * (exp(-density (D - m)) - exp(-density (U - m)))) / density
// but no point gets more than all light. Beyond the buffer light is unattenuated, and unscattered.
// Blending: off.
#include "bindings.h"
#include "opacity.glsl"

layout(constant_id = kColoredLightBufferConstant) const bool kColoredLightBuffer = false;
layout(constant_id = kUnscatteredLightConstant) const bool kUnscatteredLight = false;

const int kChannels = kColoredLightBuffer ? 3 : 1;

layout(std140, binding = kBlurBinding) uniform Blur { BlurBlock blur; };
layout(binding = kSourceBinding) uniform sampler2D source;
layout(location = 0) out vec4 blurred;

// Colours in rgb, unscattered light in a.
vec4 Fetch(int distance_from_centre) {
  ivec2 texel = ivec2(gl_FragCoord.xy) + distance_from_centre * ivec2(blur.axis.xy);
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, textureSize(source, 0)))) {
    return vec4(0.0);
  }
  vec4 value = texelFetch(source, texel, 0);
  return kColoredLightBuffer ? value : value.rrrg;
}

void main() {
  int radius = int(blur.axis.z);
  vec4 centre = Fetch(0);
  vec3 least = centre.rgb;
  for (int d = 1; d <= radius; ++d) least = min(least, min(Fetch(d).rgb, Fetch(-d).rgb));

  // Light kept and light lost: which of the two has the digits depends on the shadow's depth.
  vec3 kept = vec3(0.0);
  vec3 lost = vec3(0.0);
  for (int d = -radius; d <= radius; ++d) {
    vec3 weight = blur.weights[abs(d)].rgb;
    vec4 value = Fetch(d);
    vec3 depth = blur.density.rgb * (value.rgb - least);
    for (int c = 0; c < kChannels; ++c) {
      float opacity = OpacityFromOpticalDepth(depth[c]);
      lost[c] += weight[c] * opacity;
      kept[c] += weight[c] * (depth[c] < 1.0 ? 1.0 - opacity : exp(-depth[c]));
      if (kUnscatteredLight) {
        // What unscattered light keeps or loses by not spreading.
        float stays = d == 0 ? 1.0 - weight[c] : -weight[c];
        float unscattered = blur.density[c] * max(value.a - least[c], 0.0);
        lost[c] += stays * OpacityFromOpticalDepth(unscattered);
        kept[c] += stays * exp(-unscattered);
      }
    }
  }
  blurred = kColoredLightBuffer ? vec4(vec3(0.0), centre.a) : vec4(0.0, centre.a, 0.0, 0.0);
  for (int c = 0; c < kChannels; ++c) {
    float density = blur.density[c];
    // A colour that nothing attenuates needs no spreading.
    blurred[c] = density > 0.0
                     ? least[c] + OpticalDepthFromOpacity(lost[c], kept[c]) / density
                     : centre[c];
    if (kUnscatteredLight) blurred[c] = max(blurred[c], 0.0);
  }
}
