#include "renderer/shadow_technique.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "renderer/field_error.h"
#include "renderer/projection.h"
#include "renderer/techniques/half_angle.h"
#include "renderer/techniques/light_sweep.h"
#include "renderer/techniques/particle_shadow_map.h"
#include "renderer/techniques/reference.h"

namespace halflight {

const ShadowTechnique& TechniqueFor(ShadowTechniqueKind kind) {
  static const HalfAngle half_angle;
  static const LightSweep light_sweep;
  static const ParticleShadowMap particle_shadow_map;
  static const Reference reference;
  switch (kind) {
    case ShadowTechniqueKind::kLightSweep:
      return light_sweep;
    case ShadowTechniqueKind::kParticleShadowMap:
      return particle_shadow_map;
    case ShadowTechniqueKind::kReference:
      return reference;
    case ShadowTechniqueKind::kHalfAngle:
      break;
  }
  return half_angle;
}

ShadowTechniqueKind DefaultTechnique(const FrameRequest& request, bool software_renderer) {
  const auto sweep = ShadowTechniqueKind::kLightSweep;
  return software_renderer && TechniqueFor(sweep).Check(request).ok()
             ? sweep
             : ShadowTechniqueKind::kHalfAngle;
}

SliceCompositor CompositorFor(SliceCompositor asked, bool software_renderer) {
  if (asked != SliceCompositor::kAuto) return asked;
  return software_renderer ? SliceCompositor::kRaster : SliceCompositor::kTiles;
}

LightReport ReportOf(const Projection& light) {
  LightReport report;
  report.casts_shadows = true;
  report.light_texture_from_world = light.texture_from_world();
  report.light_view_from_world = light.view_from_world;
  return report;
}

bool Shows(const FrameRequest& request, ImageKind kind) {
  return std::any_of(request.images.begin(), request.images.end(),
                     [kind](const ImageRequest& image) { return image.kind == kind; });
}

bool ShowsOfLight(const FrameRequest& request, ImageKind kind, size_t light) {
  return std::any_of(request.images.begin(), request.images.end(), [&](const ImageRequest& image) {
    return image.kind == kind && image.light_index == static_cast<int>(light);
  });
}

absl::Status CheckLightCount(const Scene& scene) {
  if (scene.lights.size() <= kMaxLights) return absl::OkStatus();
  return FieldError("lighting.lights", absl::StrCat(scene.lights.size(), " lights"),
                    absl::StrCat("at most ", kMaxLights));
}

absl::Status Refuse(const std::string& field, const std::string& value, const char* technique,
                    const std::string& allowed) {
  return FieldError(field, value, allowed, absl::StrCat(" under technique ", technique));
}

absl::Status CheckLightsOutside(const Scene& scene, const ParticleView& particles,
                                const char* technique) {
  for (size_t l = 0; l < scene.lights.size(); ++l) {
    if (!scene.lights[l].casts_shadows() || !LiesAmong(scene.lights[l], particles)) continue;
    const glm::dvec3& at = std::get<PointLight>(scene.lights[l].kind).position;
    return Refuse(absl::StrCat("lighting.lights[", l, "].point.position"),
                  absl::StrCat("(", at.x, ", ", at.y, ", ", at.z, ")"), technique,
                  "outside the particles, for a light that casts shadows");
  }
  return absl::OkStatus();
}

absl::Status CheckNoScattering(const Scene& scene, const char* technique, const char* reason) {
  if (!scene.scatters()) return absl::OkStatus();
  const std::string allowed = absl::StrCat("0, since ", reason);
  if (scene.shadow.blur_mode == BlurMode::kTexelsPerSlice) {
    return Refuse("shadow.blur_texels", absl::StrCat(scene.shadow.blur_texels), technique, allowed);
  }
  if (scene.material.scattering_spread > 0.0F) {
    return Refuse("material.scattering_spread", absl::StrCat(scene.material.scattering_spread),
                  technique, allowed);
  }
  return Refuse("material.physical_scattering.albedo",
                absl::StrCat(scene.material.physical_scattering->albedo), technique, allowed);
}

}  // namespace halflight
