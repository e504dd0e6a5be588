#include "server/convert/convert_scene.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "renderer/target/features.h"
#include "server/convert/convert_camera.h"
#include "server/convert/enums.h"
#include "server/convert/geometry.h"
#include "server/convert/particle_bounds.h"

namespace halflight {
namespace {

constexpr double kMaxSampling = 8.0;
constexpr double kMaxBlurTexels = 64.0;

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

ShadowSettings ConvertShadow(const v1::Shadow& shadow, const ServerLimits& limits,
                             FieldChecks& checks) {
  const std::string path = "scene.shadow";
  ShadowSettings converted;
  converted.technique =
      FromProto(kTechniques, shadow.technique(), converted.technique, path + ".technique", checks);
  const auto default_slices = std::min<uint32_t>(converted.slices, limits.max_slices);
  converted.slices = static_cast<int>(checks.InRangeOr(
      path + ".slices", shadow.slices(), default_slices,
      {.low = 1.0, .high = static_cast<double>(limits.max_slices), .server_limit = true}));
  converted.interpolate = !shadow.has_interpolate() || shadow.interpolate();
  converted.spacing =
      FromProto(kSpacings, shadow.spacing(), converted.spacing, path + ".spacing", checks);
  converted.compositor = FromProto(kCompositors, shadow.compositor(), converted.compositor,
                                   path + ".compositor", checks);
  converted.max_light_buffer_size = static_cast<int>(limits.max_light_buffer_size);
  converted.light_buffer_size =
      static_cast<int>(checks.InRangeOr(path + ".light_buffer_size", shadow.light_buffer_size(), 0U,
                                        {.low = static_cast<double>(kMinLightBufferSize),
                                         .high = static_cast<double>(limits.max_light_buffer_size),
                                         .server_limit = true}));
  if (shadow.has_fit_degree()) {
    converted.fit_degree =
        static_cast<int>(checks.InRange(path + ".fit_degree", shadow.fit_degree(),
                                        {.low = 0.0, .high = static_cast<double>(kMaxFitDegree)}));
  }
  converted.blur_mode =
      FromProto(kBlurModes, shadow.blur_mode(), converted.blur_mode, path + ".blur_mode", checks);
  converted.blur_texels = shadow.blur_texels();
  if (converted.blur_mode == BlurMode::kTexelsPerSlice) {
    checks.InRange(path + ".blur_texels", converted.blur_texels,
                   {.low = 0.0, .high = kMaxBlurTexels, .open_low = true});
  } else if (converted.blur_texels != 0.0F) {
    checks.Reject(path + ".blur_texels", fmt::format("{}", converted.blur_texels),
                  "unset, unless blur_mode is BLUR_MODE_TEXELS_PER_SLICE");
  }
  return converted;
}

// One for all requests, so that a set is walked over once and not whenever it is named: requests
// are converted on threads that answer calls.
std::shared_ptr<const ParticleBounds> KnownBounds(const std::shared_ptr<const ParticleSet>& set) {
  static BoundsCache cache;
  return cache.Of(set);
}

bool IsAllowed(const glm::dvec3& offset) {
  return kOffset.Contains(offset.x) && kOffset.Contains(offset.y) && kOffset.Contains(offset.z);
}

// Positions as they are after the offset keep to the bounds of those that are sent.
void CheckMoved(const std::shared_ptr<const ParticleSet>& set, double time_offset_s,
                FieldChecks& checks) {
  const VectorRange reached = PositionsAfter(*KnownBounds(set), time_offset_s);
  if (IsAllowed(reached.low) && IsAllowed(reached.high)) {
    return;
  }
  const ParticleSet& particles = *set;
  for (size_t i = 0; i < particles.velocities.size() && checks.ok(); ++i) {
    const glm::dvec3 moved =
        glm::dvec3(particles.positions[i]) + time_offset_s * glm::dvec3(particles.velocities[i]);
    if (!IsAllowed(moved)) {
      checks.Reject("scene.time_offset_s",
                    fmt::format("{}, which moves particle {} to ({}, {}, {})", time_offset_s, i,
                                moved.x, moved.y, moved.z),
                    "positions in " + kOffset.ToString());
    }
  }
}

bool Moves(const Scene& scene) {
  return scene.time_offset_s != 0.0 && !scene.particles->velocities.empty();
}

// Bounds of the scene's particles, without a walk over them where they are at rest.
std::optional<BoundingSphere> BoundsOf(const Scene& scene) {
  const ParticleSet& set = *scene.particles;
  if (Moves(scene)) {
    return Bounds(set, scene.material.radius, scene.time_offset_s);
  }
  std::optional<BoundingSphere> sphere = KnownBounds(scene.particles)->at_rest;
  if (sphere.has_value() && set.radii.empty()) {
    sphere->radius += scene.material.radius;
  }
  return sphere;
}

// Whether the point is so far from particles that move that they need not be walked over: the
// middle of their bounding sphere is in the box, and its radius no more than half the diagonal and
// a particle's.
bool IsFarFrom(const Scene& scene, const glm::dvec3& point) {
  constexpr double kRounding = 1e-9;
  const ParticleSet& set = *scene.particles;
  const auto bounds = KnownBounds(scene.particles);
  const VectorRange box = PositionsAfter(*bounds, scene.time_offset_s);
  const glm::dvec3 offset = point - set.origin;
  const double distance =
      glm::length(glm::max(glm::dvec3(0.0), glm::max(box.low - offset, offset - box.high)));
  const double own = set.radii.empty() ? scene.material.radius : bounds->largest_radius;
  const double radius = 0.5 * glm::length(box.high - box.low) + own;
  return distance > radius + kRounding * (glm::length(point) + glm::length(set.origin) + radius);
}

// A light buffer shows the particles from the light through one frustum, so that a light among them
// would see only some.
void CheckPointLights(const Scene& scene, FieldChecks& checks) {
  std::optional<BoundingSphere> bounds;  // once a light has asked
  for (size_t i = 0; i < scene.lights.size(); ++i) {
    const auto* const point = std::get_if<PointLight>(&scene.lights[i].kind);
    if (point == nullptr || !scene.lights[i].casts_shadows() || scene.particles->size() == 0 ||
        (Moves(scene) && IsFarFrom(scene, point->position))) {
      continue;
    }
    if (!bounds.has_value()) {
      bounds = BoundsOf(scene);
    }
    const double distance = glm::length(point->position - bounds->center);
    if (!(distance > bounds->radius)) {
      checks.Reject(
          fmt::format("scene.lighting.lights[{}].point.position", i),
          fmt::format("{} from the centre of the particles", distance),
          fmt::format("more than {}, the radius of their bounding sphere, for a light "
                      "that casts shadows under {}",
                      bounds->radius,
                      v1::ShadowTechnique_Name(ToProto(kTechniques, scene.shadow.technique))));
    }
  }
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
  if (converted.time_offset_s != 0.0 && converted.particles->velocities.empty() &&
      converted.particles->size() > 0) {
    checks.Reject("scene.time_offset_s", fmt::format("{}", converted.time_offset_s),
                  "0 or unset where the particle set has no VELOCITY");
  }
  if (converted.material.physical_scattering &&
      converted.shadow.blur_mode == BlurMode::kTexelsPerSlice) {
    checks.Reject("scene.material.physical_scattering",
                  "set with a blur_mode of BLUR_MODE_TEXELS_PER_SLICE", "BLUR_MODE_DISTANCE");
  }
  if (checks.ok() && Moves(converted)) {
    CheckMoved(converted.particles, converted.time_offset_s, checks);
  }
  return converted;
}

bool LeavesTechniqueOpen(const v1::Shadow& shadow) {
  return shadow.technique() == v1::SHADOW_TECHNIQUE_UNSPECIFIED && shadow.slices() == 0 &&
         !shadow.has_interpolate() && shadow.spacing() == v1::SLICE_SPACING_UNSPECIFIED &&
         shadow.blur_mode() == v1::BLUR_MODE_UNSPECIFIED && shadow.blur_texels() == 0.0F &&
         shadow.compositor() == v1::SLICE_COMPOSITOR_UNSPECIFIED;
}

void CheckTechnique(const Scene& scene, const ServerLimits& limits, FieldChecks& checks) {
  if (scene.shadow.technique != ShadowTechniqueKind::kReference) {
    CheckPointLights(scene, checks);
  } else {
    CheckReferenceWork("scene.shadow.technique", "SHADOW_TECHNIQUE_REFERENCE",
                       static_cast<double>(scene.camera.window.width) * scene.camera.window.height,
                       scene, limits, checks);
  }
}

void CheckReferenceWork(const std::string& field, const std::string& what, double pixels,
                        const Scene& scene, const ServerLimits& limits, FieldChecks& checks) {
  const double work = ReferenceWork(scene, pixels);
  if (work > static_cast<double>(limits.max_reference_work)) {
    const auto particles = static_cast<double>(scene.particles->size());
    checks.Reject(
        field,
        fmt::format("{} of {} samples times {} particles", what, work / particles, particles),
        fmt::format("a product of at most {}", limits.max_reference_work), /*server_limit=*/true);
  }
}

v1::Shadow DescribeShadow(const ShadowSettings& shadow) {
  v1::Shadow described;
  described.set_technique(ToProto(kTechniques, shadow.technique));
  described.set_slices(shadow.slices);
  described.set_interpolate(shadow.interpolate);
  described.set_spacing(ToProto(kSpacings, shadow.spacing));
  described.set_light_buffer_size(shadow.light_buffer_size);
  described.set_blur_mode(ToProto(kBlurModes, shadow.blur_mode));
  described.set_blur_texels(shadow.blur_texels);
  described.set_fit_degree(shadow.fit_degree);
  described.set_compositor(ToProto(kCompositors, shadow.compositor));
  return described;
}

}  // namespace halflight
