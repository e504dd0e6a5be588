// The one interface chosen at run time: how a light's shadows get into the image.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/frame_plan.h"
#include "renderer/image.h"

namespace halflight {

struct LightReport;
struct TraversalContext;

// What a technique leaves of a light besides its part of the image.
struct ShadowResult {
  // Optical depth in the light buffer behind all particles, and after every slice: one or three
  // channels, empty unless the traversal keeps them.
  Image light_buffer;
  Image light_layers;
};

class ShadowTechnique {
 public:
  virtual ~ShadowTechnique() = default;

  // How light number `light` of the scene will be drawn: axis, slices, light buffer. No GL.
  // InvalidArgument, naming the field, for what the technique cannot do.
  [[nodiscard]] virtual absl::StatusOr<Traversal> PlanLight(const Scene& scene,
                                                            const ParticleView& particles,
                                                            int light) const = 0;

  // The passes that the traversal comes to, for people.
  [[nodiscard]] virtual std::vector<PlannedPass> DescribePasses(
      const Traversal& traversal) const = 0;

  // Draws the traversal into the context's targets and fills in `report`. Cancelled when the
  // context's stop token says so. Needs the GL context.
  virtual absl::StatusOr<ShadowResult> Draw(const TraversalContext& context,
                                            LightReport& report) const = 0;
};

// Of the kinds that draw traversals: neither kReference (reference_frame.h) nor kLightSweep
// (sweep/sweep_frame.h).
const ShadowTechnique& TechniqueFor(ShadowTechniqueKind kind);

}  // namespace halflight
