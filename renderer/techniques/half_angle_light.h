// One light of half-angle slicing: Green 2008, "Volumetric Particle Shadows", after Kniss et al.
// 2003, "A model for volume lighting and modeling". Particles are sorted along the half vector of
// view and light, so that one order serves both: slice after slice is drawn into the image, lit by
// the light buffer, and into the light buffer.
#pragma once

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame.h"
#include "renderer/frame_images.h"
#include "renderer/particle_view.h"
#include "renderer/techniques/traversal_context.h"

namespace halflight {

// The axis and the direction of compositing for a view direction and the direction in which light
// travels (unit vectors).
struct HalfAngleAxis {
  glm::dvec3 axis;     // unit; particles in ascending order are nearest the light first
  bool back_to_front;  // as the eye sees that order
};
HalfAngleAxis ComputeHalfAngleAxis(const glm::dvec3& view, const glm::dvec3& light);

// How light number `light` of the scene, which lies outside the particles, will be drawn: axis,
// slices, light buffer. No GL.
Traversal PlanHalfAngleLight(const Scene& scene, const ParticleView& particles, int light);

// The traversal's order of particles, which an earlier frame may have left; then it says so in
// `context.reused`.
absl::StatusOr<std::shared_ptr<const DeviceOrder>> SortForTraversal(
    const TraversalContext& context);

// How a traversal's particles are sorted, for people.
PlannedPass DescribeSort(const Traversal& traversal);
// The passes that the traversal comes to, for people.
std::vector<PlannedPass> DescribeHalfAnglePasses(const Traversal& traversal);

// Draws the traversal into the context's targets and fills in `report`; the context's readback will
// fill in what outputs show of `shadow`. Cancelled when the context's stop token says so. Needs the
// GL context.
absl::Status DrawHalfAngleLight(const TraversalContext& context, LightReport& report,
                                ShadowResult& shadow);

}  // namespace halflight
