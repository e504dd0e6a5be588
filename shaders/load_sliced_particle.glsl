// Reads the particle at a place of the order. Included after sliced_particle.glsl.

layout(constant_id = kHasColorsConstant) const bool kHasColors = false;
layout(constant_id = kHasEmissionsConstant) const bool kHasEmissions = false;

layout(std430, binding = kOrderBinding) readonly buffer Order { OrderedParticle order[]; };
layout(std430, binding = kColorsBinding) readonly buffer Colors { float colors[]; };
layout(std430, binding = kEmissionsBinding) readonly buffer Emissions { float emissions[]; };
layout(std430, binding = kSplatsBinding) readonly buffer Splats { Splat splats[]; };
layout(std430, binding = kLightSplatsBinding) readonly buffer LightSplats { Splat light_splats[]; };

SlicedParticle LoadSlicedParticle(uint place) {
  SlicedParticle p;
  uint i = order[place].index;
  p.center = splats[place].center;
  p.optics = vec4(splats[place].optics.xy, order[place].place, 0.0);
  p.albedo = composite.albedo.rgb;
  if (kHasColors) p.albedo *= vec3(colors[3u * i], colors[3u * i + 1u], colors[3u * i + 2u]);
  p.emission = composite.emission.rgb;
  if (kHasEmissions) {
    p.emission = vec3(emissions[3u * i], emissions[3u * i + 1u], emissions[3u * i + 2u]);
  }
  p.light_center = vec4(0.0);
  if (kShadowed) {
    p.light_center = light_splats[place].center;
    p.optics.w = light_splats[place].optics.x;
  }
  return p;
}
