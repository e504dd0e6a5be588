// Radiance of lights that vary with place or ray; shadows are not part of it. Included after
// bindings.h.

layout(constant_id = kPhaseConstant) const bool kPhase = false;

// Henyey and Greenstein 1941, without its 1 / (4 pi), so that g = 0 gives 1.
float PhaseFunction(float g, vec3 light_travel, vec3 ray) {
  float cosine = dot(light_travel, -ray);
  float d = 1.0 + g * g - 2.0 * g * cosine;
  return (1.0 - g * g) / (d * sqrt(d));
}

// Relative to the light's colour, at a point in view space from which a ray leads away from the eye.
float RadianceFactor(LightBlock light, float g, vec3 at, vec3 ray) {
  vec3 travel = light.vector.w != 0.0 ? at - light.vector.xyz : light.vector.xyz;
  float factor = light.color.w != 0.0 ? 1.0 / dot(travel, travel) : 1.0;
  if (kPhase) factor *= PhaseFunction(g, normalize(travel), normalize(ray));
  return factor;
}
