// One light of half-angle slicing: Green 2008, "Volumetric Particle Shadows", after Kniss et al.
// 2003, "A model for volume lighting and modeling". Particles are sorted along the half vector of
// view and light, so that one order serves both: slice after slice is drawn into the image, lit by
// the light buffer, and into the light buffer.
#pragma once

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

// How light number `light` of the scene will be drawn: axis, slices, light buffer. No GL.
// InvalidArgument, naming the field, for a shadow-casting light among the particles.
absl::StatusOr<Traversal> PlanHalfAngleLight(const Scene& scene, const ParticleView& particles,
                                             int light);

// The passes that the traversal comes to, for people.
std::vector<PlannedPass> DescribeHalfAnglePasses(const Traversal& traversal);

// Draws the traversal into the context's targets and fills in `report`. Cancelled when the
// context's stop token says so. Needs the GL context.
absl::StatusOr<ShadowResult> DrawHalfAngleLight(const TraversalContext& context,
                                                LightReport& report);

}  // namespace halflight
