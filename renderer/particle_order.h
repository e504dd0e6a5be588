// The order in which a traversal meets the particles, and how it is cut into slices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/frame_plan.h"
#include "renderer/particle_view.h"
#include "shaders/bindings.h"

namespace halflight {

struct ParticleOrder {
  std::vector<shader::OrderedParticle> particles;
  // Slice s is particles [slice_begin[s], slice_begin[s + 1]); some may be empty.
  std::vector<uint32_t> slice_begin;
  // Where along the axis the middle of each slice lies: the mean of its particles; an empty slice
  // lies where the one before it does. Empty for an order by distance.
  std::vector<double> slice_position;
  double end_position = 0.0;  // of the last particle along the axis
};

// Sorts by the traversal's axis, or by distance from the eye (`eye` is relative to the set's
// origin), and cuts into the traversal's slices: every particle falls into exactly one, and alone
// where there are no fewer slices than particles.
ParticleOrder OrderParticles(const ParticleView& particles, const Traversal& traversal,
                             const glm::dvec3& eye);

// Slice s of particles in this order is places [begin[s], begin[s + 1]), in at most as many slices
// as there are particles, at least one: the same number of particles each, or the same share of the
// sum of optical depth times squared radius. As many slices as particles are one particle each.
std::vector<uint32_t> CutIntoSlices(const ParticleView& particles, std::span<const uint32_t> order,
                                    int slices, SliceSpacing spacing);

}  // namespace halflight
