// How the tile compositor keeps particles in the light: one head each, and for each slot of a light
// a record of floats. Included after bindings.h and splat.glsl.
//   head    vec4: plane coordinates x, y, scale (of near ones the centre in radii); optical depth
//           vec4: rgb without the lights that follow; 1 where near
//           vec4: albedo
//           vec4: depth as a polynomial 1, y, x (of near ones: depth, radius); only with that output
//   record  radiance relative to the light's colour;
//           the exponents' polynomials, one or three, as in renderer/sweep/kernels.h;
//           NearLight, where there are near particles.

layout(constant_id = kDepthOutputConstant) const bool kDepthOutput = false;
layout(constant_id = kColoredDensityConstant) const bool kColoredDensity = false;
layout(constant_id = kFitDegreeConstant) const int kDegree = 0;

const uint kHeadVectors = kDepthOutput ? 4 : 3;
const int kTerms = (kDegree + 1) * (kDegree + 2) / 2;
const int kExponents = kColoredDensity ? 3 : 1;
const uint kExponentsAt = 1;
const uint kNearAt = kExponentsAt + uint(kExponents * kTerms);
const uint kRecordFloats = kNearAt + (kNearEye ? 6 : 0);
