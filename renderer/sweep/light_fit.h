// How much of a light every particle gets over its own footprint, as a polynomial: swept through
// the particles in their order along the light, or from layers between which a particle lies.
#pragma once

#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/block_cache.h"
#include "renderer/frame_plan.h"
#include "renderer/image.h"
#include "renderer/particle_view.h"
#include "renderer/projection.h"
#include "renderer/scene.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

struct LightFit {
  Projection projection;
  int degree = 0;
  int channels = 1;  // polynomials a particle: one, or three where the colours' light differs
  // By particle and channel, Terms(degree) coefficients: the optical depth that the light met
  // before it, as a polynomial in its scaled coordinates as `projection` sees it.
  Block<float> depth;
  Image optical_depth;  // behind all particles, by channel
  Image layers;         // the same behind every slab; empty unless kept

  // Of a colour of the light.
  [[nodiscard]] const float* DepthOf(size_t particle, size_t color) const {
    const auto per_particle = static_cast<size_t>(channels);
    const auto terms = static_cast<size_t>((degree + 1) * (degree + 2) / 2);
    return &depth[(particle * per_particle + (per_particle > 1 ? color : 0)) * terms];
  }
  [[nodiscard]] size_t bytes() const {
    return (depth.capacity() + optical_depth.pixels.capacity() + layers.pixels.capacity()) *
           sizeof(float);
  }
};

// What a fit is made with. Sums of a particle that lies across tiles wait for all of its tiles:
// 2 * Terms(degree) floats an entry, at most 59 MiB at degree 4 with these limits; twice that for a
// light of three colours. A bin of a particle shadow map that takes several runs is gone through
// twice.
inline constexpr RunLimits kLightRuns{.rects = 1U << 18U, .entries = 1U << 19U};

// Whether particles see the light between layers: those of a particle shadow map.
inline bool IsLayered(const Scene& scene) {
  return scene.shadow.technique == ShadowTechniqueKind::kParticleShadowMap;
}

// How light number `light` of a scene, which casts shadows and lies outside the particles, is swept
// through them: along its own way, in slabs (Traversal::slices) where it scatters, where layers are
// kept, or where the scene's technique is the particle shadow map; else in one.
Traversal PlanLight(const Scene& scene, const ParticleView& particles, int light,
                    bool keep_layers = false);

// Deposits the particles nearest the light first, each as the light buffer's texels show it, and
// fits to the texels it covers what lay before, to a degree of shadow.fit_degree; `traversal` is
// planned by PlanLight. Of a particle shadow map, what lay before is taken between the layers
// before and behind a particle's slab, linearly to its own place. Between slabs light that scatters
// spreads; only then the light's density matters, and its colour never does. Cancelled when `stop`
// says so. Any thread; uses all cores. The result is the same for all `limits`, which bound what is
// held besides.
absl::StatusOr<LightFit> FitLight(const Scene& scene, const ParticleView& particles,
                                  const Traversal& traversal, const std::stop_token& stop,
                                  const RunLimits& limits = kLightRuns);

}  // namespace halflight::sweep
