#version 450
#extension GL_GOOGLE_include_directive : require
// The rectangles of splats within a band of their target, in its own pixels, as tile lists take
// them: begin | end << 16 along x, along y; 0 where the band has none of the splat.
#include "bindings.h"
#include "workgroup.glsl"

layout(local_size_x = kListGroupSize) in;

layout(std140, binding = kProjectionBinding) uniform Projections { ProjectionBlock projection; };
layout(std140, binding = kParticlesBinding) uniform Particles { ParticlesBlock particles; };
layout(std430, binding = kSplatsBinding) readonly buffer Splats { Splat splats[]; };
layout(std430, binding = kSplatRectsBinding) writeonly buffer Rects { uvec2 rects[]; };

void main() {
  uint place = WorkgroupIndex() * kListGroupSize + gl_LocalInvocationIndex;
  if (place >= particles.count.x) return;
  vec4 rect = splats[place].rect - projection.band.xyxy;
  vec2 low = clamp(rect.xy, vec2(0.0), projection.band.zw);
  vec2 high = clamp(rect.zw, vec2(0.0), projection.band.zw);
  bool seen = low.x < high.x && low.y < high.y;
  rects[place] = seen ? uvec2(low) | uvec2(high) << 16u : uvec2(0u);
}
