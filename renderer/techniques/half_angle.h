// Half-angle slicing: Green 2008, "Volumetric Particle Shadows", after Kniss et al. 2003, "A model
// for volume lighting and modeling". Particles are sorted along the half vector of view and light,
// so that one order serves both: slice after slice is drawn into the image, lit by the light
// buffer, and into the light buffer.
#pragma once

#include "renderer/shadow_technique.h"

namespace halflight {

// The axis and the direction of compositing for a view direction and the direction in which light
// travels (unit vectors).
struct HalfAngleAxis {
  glm::dvec3 axis;     // unit; particles in ascending order are nearest the light first
  bool back_to_front;  // as the eye sees that order
};
HalfAngleAxis ComputeHalfAngleAxis(const glm::dvec3& view, const glm::dvec3& light);

class HalfAngle : public ShadowTechnique {
 public:
  [[nodiscard]] absl::StatusOr<Traversal> PlanLight(const Scene& scene,
                                                    const ParticleView& particles,
                                                    int light) const override;
  [[nodiscard]] std::vector<PlannedPass> DescribePasses(const Traversal& traversal) const override;
  absl::StatusOr<ShadowResult> Draw(const TraversalContext& context,
                                    LightReport& report) const override;
};

}  // namespace halflight
