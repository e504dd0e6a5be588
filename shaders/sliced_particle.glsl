// A particle of a traversal in slices, as a pass of the eye takes it. Included after bindings.h.

layout(constant_id = kShadowedConstant) const bool kShadowed = false;

layout(std140, binding = kCompositeBinding) uniform Composite { CompositeBlock composite; };

struct SlicedParticle {
  vec4 center;        // of the eye's splat
  vec4 optics;        // optical depth, general, place within the slice, optical depth for the light
  vec3 albedo;
  vec3 emission;
  vec4 light_center;  // of the light's splat
};
