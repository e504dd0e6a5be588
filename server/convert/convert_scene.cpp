#include "server/convert/convert_scene.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/convert/convert_camera.h"
#include "server/convert/convert_shadow.h"
#include "server/convert/enums.h"
#include "server/convert/scene_checks.h"

namespace halflight {
namespace {

constexpr double kMaxSampling = 8.0;

glm::vec3 ConvertColor(const v1::Color& color, const std::string& field, FieldChecks& checks) {
  return {checks.InRange(field + ".r", color.r(), kNotNegative),
          checks.InRange(field + ".g", color.g(), kNotNegative),
          checks.InRange(field + ".b", color.b(), kNotNegative)};
}

Sampling ConvertSampling(const v1::Sampling& sampling, FieldChecks& checks) {
  const Interval rates{.low = 1.0, .high = kMaxSampling};
  Sampling converted;
  if (sampling.has_supersample()) {
    converted.supersample = static_cast<int>(
        checks.InRange("scene.sampling.supersample", sampling.supersample(), rates));
  } else if (sampling.has_downsample()) {
    converted.downsample =
        static_cast<int>(checks.InRange("scene.sampling.downsample", sampling.downsample(), rates));
  }
  return converted;
}

Light ConvertLight(const v1::Light& light, const std::string& path, FieldChecks& checks) {
  Light converted;
  if (light.has_directional()) {
    converted.kind = DirectionalLight{
        ConvertDirection(light.directional().direction(), path + ".directional.direction", checks)};
  } else if (light.has_point()) {
    const std::string position = path + ".point.position";
    if (!light.point().has_position()) {
      checks.Reject(position, "unset", "a point");
    }
    converted.kind = PointLight{ConvertVector(light.point().position(), position, kPlace, checks),
                                light.point().inverse_square_falloff()};
  } else {
    checks.Reject(path + ".kind", "unset", "directional or point");
  }
  if (light.has_color()) {
    converted.color = ConvertColor(light.color(), path + ".color", checks);
  }
  if (light.has_density_rgb()) {
    converted.shadow_density = ConvertColor(light.density_rgb(), path + ".density_rgb", checks);
  } else if (light.shadow_density_case() == v1::Light::kDensity) {
    converted.shadow_density =
        glm::vec3(checks.InRange(path + ".density", light.density(), kNotNegative));
  }
  return converted;
}

PhysicalScattering ConvertScattering(const v1::Material& material, const std::string& path,
                                     FieldChecks& checks) {
  const v1::PhysicalScattering& scattering = material.physical_scattering();
  PhysicalScattering converted;
  converted.mean_cosine = checks.InRange(path + ".mean_cosine", scattering.mean_cosine(),
                                         {.low = 0.0, .high = 1.0, .open_high = true});
  if (scattering.has_albedo()) {
    converted.albedo =
        checks.InRange(path + ".albedo", scattering.albedo(), {.low = 0.0, .high = 1.0});
  }
  if (material.scattering_spread() != 0.0F) {
    checks.Reject(path,
                  fmt::format("set beside a scattering_spread of {}", material.scattering_spread()),
                  "one of physical_scattering and scattering_spread");
  }
  return converted;
}

Material ConvertMaterial(const v1::Material& material, const ParticleSet& particles,
                         FieldChecks& checks) {
  const std::string path = "scene.material";
  Material converted;
  converted.profile =
      FromProto(kProfiles, material.profile(), converted.profile, path + ".profile", checks);
  if (material.has_radius()) {
    if (particles.radii.empty()) {
      converted.radius = checks.InRange(path + ".radius", material.radius(), kRadius);
    }
  } else if (particles.radii.empty() && particles.size() > 0) {
    checks.Reject(path + ".radius", "unset",
                  kRadius.ToString() + " where the particle set has no RADIUS");
  }
  if (material.has_opacity() && particles.opacities.empty()) {
    converted.opacity =
        checks.InRange(path + ".opacity", material.opacity(), {.low = 0.0, .high = 1.0});
  }
  if (material.has_albedo()) {
    converted.albedo = ConvertColor(material.albedo(), path + ".albedo", checks);
  }
  if (material.has_emission() && particles.emissions.empty()) {
    converted.emission = ConvertColor(material.emission(), path + ".emission", checks);
  }
  if (material.has_ambient()) {
    converted.ambient = ConvertColor(material.ambient(), path + ".ambient", checks);
  }
  converted.phase_g =
      checks.InRange(path + ".phase_g", material.phase_g(),
                     {.low = -1.0, .high = 1.0, .open_low = true, .open_high = true});
  converted.scattering_spread =
      checks.InRange(path + ".scattering_spread", material.scattering_spread(), kNotNegative);
  if (material.has_physical_scattering()) {
    converted.physical_scattering =
        ConvertScattering(material, path + ".physical_scattering", checks);
  }
  return converted;
}

}  // namespace

Scene ConvertScene(const v1::Scene& scene, std::shared_ptr<const ParticleSet> particles,
                   const ServerLimits& limits, FieldChecks& checks) {
  Scene converted;
  converted.particles = std::move(particles);

  // Each part by itself.
  // As a factor of velocities it is a 32-bit float.
  converted.time_offset_s = checks.InRange("scene.time_offset_s", scene.time_offset_s(), kOffset);
  converted.sampling = ConvertSampling(scene.sampling(), checks);
  if (!scene.has_camera()) {
    checks.Reject("scene.camera", "unset", "a camera");
  }
  converted.camera = ConvertCamera(scene.camera(), converted.sampling.supersample, limits, checks);
  const auto& lights = scene.lighting().lights();
  if (static_cast<uint32_t>(lights.size()) > limits.max_lights) {
    checks.Reject("scene.lighting.lights", fmt::format("{} lights", lights.size()),
                  fmt::format("at most {}", limits.max_lights), /*server_limit=*/true);
  }
  for (int i = 0; i < lights.size() && checks.ok(); ++i) {
    converted.lights.push_back(
        ConvertLight(lights[i], fmt::format("scene.lighting.lights[{}]", i), checks));
  }
  converted.material = ConvertMaterial(scene.material(), *converted.particles, checks);
  converted.shadow = ConvertShadow(scene.shadow(), limits, checks);

  // What the parts need of each other, once each is right.
  if (converted.material.physical_scattering &&
      converted.shadow.blur_mode == BlurMode::kTexelsPerSlice) {
    checks.Reject("scene.material.physical_scattering",
                  "set with a blur_mode of BLUR_MODE_TEXELS_PER_SLICE", "BLUR_MODE_DISTANCE");
  }
  CheckMotion(converted, checks);
  return converted;
}

}  // namespace halflight
