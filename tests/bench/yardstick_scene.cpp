#include "tests/bench/yardstick_scene.h"

#include <array>
#include <cmath>
#include <variant>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>

#include "absl/strings/str_cat.h"

namespace halflight::bench {
namespace {

// Up to which the polynomial of OpacityOf holds to 1e-3.
constexpr double kMostOpticalDepth = 1.5;

absl::Status Refuse(const char* field, const char* allowed) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": allowed for the yardstick: ", allowed));
}

void SetAxis(const glm::dvec3& axis, const glm::dvec3& from, float (&row)[4]) {
  for (int i = 0; i < 3; ++i) row[i] = static_cast<float>(axis[i]);
  row[3] = static_cast<float>(glm::dot(axis, from));
}

}  // namespace

double YardstickOpticalDepth(const Scene& scene) {
  return -std::log1p(-static_cast<double>(scene.material.opacity));
}

absl::Status CheckYardstickRequest(const FrameRequest& request) {
  const Scene& scene = request.scene;
  const ParticleSet& set = *scene.particles;
  const Material& material = scene.material;
  const Camera& camera = scene.camera;
  if (request.images.size() != 1 || request.images[0].kind != ImageKind::kBeauty) {
    return Refuse("images", "the beauty alone");
  }
  if (set.positions.empty() || set.size() >> kernels::kSpriteBits != 0) {
    return Refuse("particles", "1 to 2^24 - 1");
  }
  if (!set.radii.empty() || !set.opacities.empty() || !set.colors.empty() ||
      !set.emissions.empty()) {
    return Refuse("particles", "attributes the same for all");
  }
  if (scene.lights.size() != 1 || !std::holds_alternative<DirectionalLight>(scene.lights[0].kind) ||
      scene.lights[0].colored_density()) {
    return Refuse("lights", "one, directional, of one density");
  }
  if (material.profile != Profile::kSoft) return Refuse("material.profile", "soft");
  if (material.phase_g != 0.0F || scene.scatters()) return Refuse("material", "no scattering");
  if (YardstickOpticalDepth(scene) > kMostOpticalDepth) {
    return Refuse("material.opacity", "optical depths up to 1.5");
  }
  if (!std::holds_alternative<Perspective>(camera.projection) ||
      camera.window.width != camera.width || camera.window.height != camera.height) {
    return Refuse("camera", "a whole perspective image");
  }
  if (scene.time_offset_s != 0.0 || scene.sampling != Sampling{}) {
    return Refuse("scene", "no time offset, one sample a pixel");
  }
  return absl::OkStatus();
}

// 1 - exp(-tau w) on [0, 1] as w times a cubic: the interpolation at Chebyshev's nodes, by Newton's
// divided differences.
kernels::Opacity OpacityOf(const Scene& scene) {
  const double tau = YardstickOpticalDepth(scene);
  constexpr std::array<double, 4> kNodes = {0.0380602337, 0.3086582838, 0.6913417162, 0.9619397663};
  std::array<double, 4> difference{};
  for (size_t k = 0; k < 4; ++k) difference[k] = -std::expm1(-tau * kNodes[k]) / kNodes[k];
  for (size_t order = 1; order < 4; ++order) {
    for (size_t k = 3; k >= order; --k) {
      difference[k] = (difference[k] - difference[k - 1]) / (kNodes[k] - kNodes[k - order]);
    }
  }
  std::array<double, 4> power{};
  for (int k = 3; k >= 0; --k) {  // power = power * (w - node) + difference
    for (size_t i = 3; i > 0; --i) power[i] = power[i - 1] - power[i] * kNodes[k];
    power[0] = difference[k] - power[0] * kNodes[k];
  }
  kernels::Opacity opacity{};
  for (size_t i = 0; i < 4; ++i) opacity.of_power[i] = static_cast<float>(power[i]);
  return opacity;
}

kernels::Views ViewsOf(const Scene& scene) {
  kernels::Views views{};
  const glm::dmat4& view = scene.camera.view_from_world;
  const glm::dvec4 origin(scene.particles->origin, 1.0);
  for (int i = 0; i < 3; ++i) {
    const glm::dvec4 row = glm::row(view, i) * (i == 2 ? -1.0 : 1.0);
    SetAxis(glm::dvec3(row), glm::dvec3(0.0), views.eye[i]);
    views.eye[i][3] = static_cast<float>(glm::dot(row, origin));
  }
  const glm::dvec3 along = std::get<DirectionalLight>(scene.lights[0].kind).direction;
  const glm::dvec3 beside = std::abs(along.y) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(along, beside));
  SetAxis(right, glm::dvec3(0.0), views.light[0]);
  SetAxis(glm::cross(along, right), glm::dvec3(0.0), views.light[1]);
  SetAxis(along, glm::dvec3(0.0), views.light[2]);
  return views;
}

kernels::Lens LensOf(const Scene& scene) {
  const Camera& camera = scene.camera;
  const double fov = std::get<Perspective>(camera.projection).vertical_fov;
  return {.center_x = 0.5F * static_cast<float>(camera.width),
          .center_y = 0.5F * static_cast<float>(camera.height),
          .pixels_per_slope = static_cast<float>(0.5 * camera.height / std::tan(0.5 * fov)),
          .radius = scene.material.radius,
          .width = camera.width,
          .height = camera.height};
}

kernels::Look LookOf(const Scene& scene) {
  const Material& material = scene.material;
  const Light& light = scene.lights[0];
  kernels::Look look{};
  for (int c = 0; c < 3; ++c) {
    look.dark[c] = material.albedo[c] * material.ambient[c] + material.emission[c];
    look.lit[c] = material.albedo[c] * light.color[c];
  }
  look.density = light.shadow_density.x;
  return look;
}

}  // namespace halflight::bench
