#version 450
#extension GL_GOOGLE_include_directive : require
// One light of the light sweep over every particle, by place: a record in the light's slot, with
//   light = color * factor * exp(-exponent(x, y))
//   exponent = density * optical depth that the light met + variation of its radiance
// The optical depth is a polynomial in the light's scaled coordinates. Those grow linearly with the
// eye's over a sprite, so that it is one in the eye's as well; near particles keep the light's.
#include "bindings.h"
#include "radiance.glsl"
#include "splat.glsl"
#include "tile_records.glsl"
#include "seen_particle.glsl"

layout(constant_id = kShadowedConstant) const bool kShadowed = false;
layout(constant_id = kPointShadowLightConstant) const bool kPointShadowLight = false;
layout(constant_id = kVaryingLightsConstant) const uint kVaryingLights = 0;

layout(std430, binding = kFitDepthBinding) readonly buffer FitDepth { float fit_depth[]; };
layout(std430, binding = kFitSpritesBinding) readonly buffer FitSprites { vec4 fit_sprites[]; };
layout(std430, binding = kShadedBinding) writeonly buffer Records { float records[]; };

// Arrays whose size is a specialisation constant cannot be assigned.
const int kMaxDegree = 6;
const int kMaxTerms = (kMaxDegree + 1) * (kMaxDegree + 2) / 2;

// Where the coefficient of x^a y^b stands.
int TermIndex(int a, int b) { return a * (kDegree + 1) - a * (a - 1) / 2 + b; }

float FactorAt(SeenParticle seen, vec2 scaled) {
  vec3 at = seen.center + seen.radius * (scaled.x * seen.x + scaled.y * seen.y);
  vec3 ray = vec3(0.0, 0.0, -1.0);
  if (!kOrthographic) {
    ray = seen.near ? seen.center : vec3(seen.sprite.xy + scaled / seen.sprite.z, -1.0);
  }
  return RadianceFactor(shade.light, shade.albedo.w, at, ray);
}

// -log(factor(x, y) / factor(0, 0)) as a polynomial through values half way to the rim.
float[kMaxTerms] FitVariation(SeenParticle seen, float at_center) {
  const float kStep = 0.6;
  float fit[kMaxTerms];
  for (int t = 0; t < kTerms; ++t) fit[t] = 0.0;
  if (kDegree == 0) return fit;
  float right = -log(max(FactorAt(seen, vec2(kStep, 0.0)) / at_center, 1e-30));
  float left = -log(max(FactorAt(seen, vec2(-kStep, 0.0)) / at_center, 1e-30));
  float up = -log(max(FactorAt(seen, vec2(0.0, kStep)) / at_center, 1e-30));
  float down = -log(max(FactorAt(seen, vec2(0.0, -kStep)) / at_center, 1e-30));
  float x = 0.5 * (right - left);
  float y = 0.5 * (up - down);
  fit[TermIndex(1, 0)] = x / kStep;
  fit[TermIndex(0, 1)] = y / kStep;
  if (kDegree == 1) return fit;
  float corner = -log(max(FactorAt(seen, vec2(kStep)) / at_center, 1e-30));
  float xx = 0.5 * (right + left);
  float yy = 0.5 * (up + down);
  fit[TermIndex(2, 0)] = xx / (kStep * kStep);
  fit[TermIndex(0, 2)] = yy / (kStep * kStep);
  fit[TermIndex(1, 1)] = (corner - x - y - xx - yy) / (kStep * kStep);
  return fit;
}

// How the light's scaled coordinates grow with the offset in radii (view axes).
mat2x3 LightAxes(SeenParticle seen) {
  vec4 sprite = fit_sprites[seen.index];
  // Enlarged particles keep tau r^2, which tells by how much they were.
  float radii = seen.sprite.w > 0.0 ? sqrt(sprite.w / seen.sprite.w) : 1.0;
  mat3 axes = transpose(mat3(shade.light_view_from_view));
  if (!kPointShadowLight) return mat2x3(radii * axes[0], radii * axes[1]);
  return mat2x3(radii * (axes[0] + sprite.x * axes[2]), radii * (axes[1] + sprite.y * axes[2]));
}

// The fitted polynomial p(u, v) with (u, v) = x of_x + y of_y.
float[kMaxTerms] Substitute(uint p, vec2 of_x, vec2 of_y) {
  float sum[kMaxTerms];
  for (int t = 0; t < kTerms; ++t) sum[t] = 0.0;
  // Coefficients of x^i y^(a + b - i) in u^a v^b, built up factor by factor.
  float u_power[kMaxDegree + 1];
  for (int i = 0; i <= kDegree; ++i) u_power[i] = i == 0 ? 1.0 : 0.0;
  for (int a = 0; a <= kDegree; ++a) {
    float product[kMaxDegree + 1] = u_power;
    for (int b = 0; a + b <= kDegree; ++b) {
      float coefficient = fit_depth[p + uint(TermIndex(a, b))];
      for (int i = 0; i <= a + b; ++i) sum[TermIndex(i, a + b - i)] += coefficient * product[i];
      for (int i = kDegree; i >= 0; --i) {
        product[i] = product[i] * of_y.y + (i > 0 ? product[max(i - 1, 0)] * of_x.y : 0.0);
      }
    }
    for (int i = kDegree; i >= 0; --i) {
      u_power[i] = u_power[i] * of_y.x + (i > 0 ? u_power[max(i - 1, 0)] * of_x.x : 0.0);
    }
  }
  return sum;
}

void main() {
  uint place = PlaceOfInvocation();
  if (place >= shade.range.x) return;
  SeenParticle seen = SeeParticle(place);
  uint record = (place * shade.range.z + shade.range.y) * kRecordFloats;

  float variation[kMaxTerms];
  for (int t = 0; t < kTerms; ++t) variation[t] = 0.0;
  float factor = 1.0;
  if (kVaryingLights != 0u) {
    factor = FactorAt(seen, vec2(0.0));
    if (!seen.near) variation = FitVariation(seen, factor);
  }
  records[record] = factor;

  float met[kMaxTerms];
  for (int t = 0; t < kTerms; ++t) met[t] = 0.0;
  mat2x3 axes = mat2x3(0.0);
  if (kShadowed) {
    axes = LightAxes(seen);
    uint p = seen.index * uint(kTerms);
    if (seen.near) {
      for (int t = 0; t < kTerms; ++t) met[t] = fit_depth[p + uint(t)];
    } else {
      met = Substitute(p, seen.x * axes, seen.y * axes);
    }
  }
  uint exponent = record + kExponentsAt;
  for (int e = 0; e < kExponents; ++e) {
    for (int t = 0; t < kTerms; ++t) {
      records[exponent++] = shade.density[e] * met[t] + variation[t];
    }
  }
  if (kNearEye) {
    for (int k = 0; k < 3; ++k) {
      records[record + kNearAt + uint(k)] = axes[0][k];
      records[record + kNearAt + uint(3 + k)] = axes[1][k];
    }
  }
}
