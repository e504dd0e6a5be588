#include "renderer/shadow_technique.h"

#include "absl/strings/str_cat.h"
#include "renderer/techniques/half_angle.h"
#include "renderer/techniques/light_sweep.h"
#include "renderer/techniques/reference.h"

namespace halflight {

const ShadowTechnique& TechniqueFor(ShadowTechniqueKind kind) {
  static const HalfAngle half_angle;
  static const LightSweep light_sweep;
  static const Reference reference;
  switch (kind) {
    case ShadowTechniqueKind::kLightSweep:
      return light_sweep;
    case ShadowTechniqueKind::kReference:
      return reference;
    case ShadowTechniqueKind::kHalfAngle:
      break;
  }
  return half_angle;
}

absl::Status CheckLightCount(const Scene& scene) {
  if (scene.lights.size() <= kMaxLights) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("lighting.lights: ", scene.lights.size(),
                                                 " lights, allowed: at most ", kMaxLights));
}

}  // namespace halflight
