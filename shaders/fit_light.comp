#version 450
#extension GL_GOOGLE_include_directive : require
// Fits the light over the footprint of every particle of a run: least squares on the monomials
// x^a y^b of scaled coordinates, weighted by the profile w, from what the sweep left in its patch.
// With sums over the patch's texels,
//   W = sum of w,  W_j = sum of w m_j,  V_j = sum of w (depth - d) m_j
//   mean = V_0 / W,  coefficient_i = (d + mean if i = 0) + sum of G_ij (V_j - mean W_j) / W
// G is the inverse of the monomials' products over the disc (DiscFit of sweep/polynomial.h). d, the
// depth in the middle of the patch, changes nothing but the rounding: deep in a cloud depth is
// large and varies little.
//
// kFitTeamSize invocations share a particle, row by row; the whole workgroup one of many rows.
#include "bindings.h"
#include "splat.glsl"
#include "light_sprite.glsl"
#include "workgroup.glsl"

layout(constant_id = kFitDegreeConstant) const int kDegree = 4;
const int kTerms = (kDegree + 1) * (kDegree + 2) / 2;
const int kPowers = kDegree + 1;

layout(local_size_x = kFitGroupSize) in;

layout(std140, binding = kInverseGramBinding) uniform Gram { InverseGramBlock inverse_gram; };
layout(std430, binding = kPatchesBinding) readonly buffer Patches { float patches[]; };
layout(std430, binding = kLightParticlesBinding) readonly buffer Particles { uint particles[]; };
layout(std430, binding = kFittedDepthBinding) writeonly buffer Fitted { float fitted_depths[]; };
layout(std430, binding = kFittedSpritesBinding) writeonly buffer Seen { vec4 fitted_sprites[]; };

const uint kTeams = kFitGroupSize / kFitTeamSize;
const uint kManyRows = 8 * kFitTeamSize;
// One float more than invocations: members of a team then read from different banks.
const uint kStride = kFitGroupSize + 1;

// Sum s of each invocation: W_j for s < kTerms, then V_j.
shared float partial[2 * kTerms * kStride];

// Invocation `member` of `members`, the first of which is invocation `first`.
struct Team {
  uint member;
  uint members;
  uint first;
};

// Four texels of a row from x on: adds w x^a and w (depth - d) x^a.
void AddTexels(uint x, uint x_end, uint patch_row, float py, float sy, vec4 sprite, float d,
               inout float weights[kPowers], inout float depths[kPowers]) {
  vec4 w;
  vec4 before;
  vec4 s;
  for (uint k = 0; k < 4; ++k) {
    bool inside = x + k < x_end;
    vec2 plane = vec2(PlaneFromTexel(vec2(float(x + k) + 0.5, 0.5)).x, py);
    s[k] = (plane.x - sprite.x) * sprite.z;
    w[k] = inside ? SpriteWeight(vec2(s[k], sy), sprite, InverseRayLength(plane)) : 0.0;
    before[k] = inside ? patches[patch_row + x + k] - d : 0.0;
  }
  for (int a = 0; a <= kDegree; ++a) {
    weights[a] += dot(w, vec4(1.0));
    depths[a] += dot(w, before);
    w *= s;
  }
}

// The member's rows.
void SumRows(TexelRect rect, vec4 sprite, uint patch_offset, float d, Team team) {
  float sums[2 * kTerms];
  for (int i = 0; i < 2 * kTerms; ++i) sums[i] = 0.0;
  uint x_end = rect.begin.x + rect.extent.x;
  for (uint row = team.member; row < rect.extent.y; row += team.members) {
    float py = PlaneFromTexel(vec2(0.5, float(rect.begin.y + row) + 0.5)).y;
    float sy = (py - sprite.y) * sprite.z;
    uint patch_row = patch_offset + row * rect.extent.x - rect.begin.x;
    float weights[kPowers];
    float depths[kPowers];
    for (int a = 0; a <= kDegree; ++a) {
      weights[a] = 0.0;
      depths[a] = 0.0;
    }
    for (uint x = rect.begin.x; x < x_end; x += 4) {
      AddTexels(x, x_end, patch_row, py, sy, sprite, d, weights, depths);
    }
    float power = 1.0;
    for (int b = 0; b <= kDegree; ++b) {
      int term = b;
      for (int a = 0; a <= kDegree - b; ++a) {
        sums[term] += weights[a] * power;
        sums[kTerms + term] += depths[a] * power;
        term += kPowers - a;
      }
      power *= sy;
    }
  }
  for (int i = 0; i < 2 * kTerms; ++i) {
    partial[uint(i) * kStride + team.first + team.member] = sums[i];
  }
}

// Adds the members' sums up, into the first member's place.
void AddUp(Team team) {
  for (uint i = team.member; i < 2 * kTerms; i += team.members) {
    uint at = i * kStride + team.first;
    float total = 0.0;
    for (uint k = 0; k < team.members; ++k) total += partial[at + k];
    partial[at] = total;
  }
}

void Solve(uint particle, float d, Team team) {
  float weight = partial[team.first];
  float inverse = weight > 0.0 ? 1.0 / weight : 0.0;
  float mean = partial[kTerms * kStride + team.first] * inverse;
  for (uint i = team.member; i < kTerms; i += team.members) {
    float coefficient = i == 0 && weight > 0.0 ? d + mean : 0.0;
    for (uint j = 1; j < kTerms; ++j) {
      float centered = (partial[(kTerms + j) * kStride + team.first] -
                        mean * partial[j * kStride + team.first]) * inverse;
      uint at = i * kTerms + j;
      coefficient += inverse_gram.rows[at / 4][at % 4] * centered;
    }
    fitted_depths[particle * kTerms + i] = coefficient;
  }
}

void main() {
  uint lane = gl_LocalInvocationIndex;
  uint first_place = places.run.x + WorkgroupIndex() * kTeams;
  // Round 0: every team its own particle, of few rows. Then all of them those of many rows, one
  // after another.
  for (uint round = 0; round <= kTeams; ++round) {
    bool together = round > 0;
    Team team = together ? Team(lane, kFitGroupSize, 0)
                         : Team(lane % kFitTeamSize, kFitTeamSize, lane - lane % kFitTeamSize);
    uint place = first_place + (together ? round - 1 : lane / kFitTeamSize);
    bool exists = place < places.run.y;
    TexelRect rect = TexelRect(uvec2(0), uvec2(0));
    if (exists) rect = RectAt(place);
    bool many_rows = rect.extent.y > kManyRows;
    if (together && !many_rows) continue;  // all invocations alike
    bool fits = exists && together == many_rows;
    if (!fits) rect.extent = uvec2(0);

    vec4 sprite = vec4(0.0);
    uint offset = 0;
    float d = 0.0;
    if (fits) {
      sprite = sprites[place];
      offset = PatchOffset(place);
      uvec2 middle = rect.extent / 2;
      if (rect.extent.x > 0) d = patches[offset + middle.y * rect.extent.x + middle.x];
    }
    SumRows(rect, sprite, offset, d, team);
    barrier();
    AddUp(team);
    barrier();
    if (fits) {
      uint particle = particles[place];
      if (team.member == 0) fitted_sprites[particle] = sprite;
      Solve(particle, d, team);
    }
    barrier();
  }
}
