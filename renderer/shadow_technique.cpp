#include "renderer/shadow_technique.h"

#include "renderer/techniques/half_angle.h"

namespace halflight {

const ShadowTechnique& TechniqueFor(ShadowTechniqueKind kind) {
  switch (kind) {
    case ShadowTechniqueKind::kHalfAngle:
    case ShadowTechniqueKind::kReference:
    case ShadowTechniqueKind::kLightSweep:
      break;
  }
  static const HalfAngle half_angle;
  return half_angle;
}

}  // namespace halflight
