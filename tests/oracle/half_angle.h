// Half-angle slicing's order of particles, and the place of each in its slice.
// Draws nothing, and computes no light.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/reference/cloud.h"
#include "renderer/reference/rays.h"
#include "renderer/scene.h"

namespace halflight::oracle {

// Of one particle, by rank.
struct SlicePlace {
  uint32_t begin;  // ranks of its slice
  uint32_t end;
  double fraction;  // its own place in the slice: 0 the first, 1 the last
};

struct HalfAngleOrder {
  glm::dvec3 axis;
  bool back_to_front;              // the last in order is nearest the eye
  std::vector<uint32_t> order;     // particles by rank, nearest the light first
  std::vector<SlicePlace> places;  // by rank
};

// `view` is the camera's forward direction, of unit length.
HalfAngleOrder OrderByHalfAngle(const reference::Cloud& cloud, const reference::Rays& light,
                                const glm::dvec3& view, const ShadowSettings& settings);

}  // namespace halflight::oracle
