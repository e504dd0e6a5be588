// How scattering spreads a light between places along its way: in world units, in texels of its
// light buffer, and by how much that buffer must reach beyond the particles. No GL; which technique
// asks does not matter.
#pragma once

#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "renderer/particle_view.h"
#include "renderer/projection.h"
#include "renderer/scattering.h"
#include "renderer/scene.h"

namespace halflight {

// How far light spreads sideways: variances along x and y of each colour, in squared texels.
struct BlurVariance {
  glm::dvec3 x;
  glm::dvec3 y;
};

class LightSpread {
 public:
  // Of a scene that scatters. Places are positions along `axis`, a unit vector, from the centre of
  // the particles' bounds, as in ParticleOrder.
  LightSpread(const Scene& scene, const Light& light, const ParticleView& particles,
              const glm::dvec3& axis);

  // By which light spreads from one slice to the next, that lie there.
  [[nodiscard]] BlurVariance InTexels(double from, double to,
                                      const glm::dvec2& texels_per_unit) const;

  // World units by which light that crosses the whole cloud has spread sideways, thrice the
  // standard deviation; never so much that the cloud itself shrinks to nothing in the light buffer.
  [[nodiscard]] double Border() const;

 private:
  // Squared world units between two positions along the axis.
  [[nodiscard]] glm::dvec3 Variance(double from, double to) const;

  ShadowSettings shadow_;
  double spread_;
  double light_along_axis_;  // distance along the axis for one along the light
  double diameter_;          // of the particles' bounds
  std::optional<PhysicalSpread> physical_;
};

// Of what light meets, the share that takes it from the light that travels forward: less than 1
// where a physical medium scatters.
double ForwardExtinction(const Material& material);

// Texels of the light buffer for one world unit at the middle of the particles.
glm::dvec2 TexelsPerUnit(const Projection& light, const ParticleView& particles);

}  // namespace halflight
