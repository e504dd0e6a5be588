#include "tests/reference/brute_force.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace halflight::reference {
namespace {

struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
};

Ray RayAt(const Camera& camera, double x, double y) {
  const glm::dmat4 world_from_view = glm::inverse(camera.view_from_world);
  const double ndc_x = 2.0 * x / camera.width - 1.0;
  const double ndc_y = 1.0 - 2.0 * y / camera.height;
  const double aspect = static_cast<double>(camera.width) / camera.height;
  if (const auto* flat = std::get_if<Orthographic>(&camera.projection)) {
    const glm::dvec4 from(ndc_x * aspect * flat->height / 2.0, ndc_y * flat->height / 2.0, 0, 1);
    return {glm::dvec3(world_from_view * from),
            glm::dvec3(world_from_view * glm::dvec4(0, 0, -1, 0))};
  }
  const double slope = std::tan(std::get<Perspective>(camera.projection).vertical_fov / 2.0);
  const glm::dvec4 toward(ndc_x * aspect * slope, ndc_y * slope, -1, 0);
  return {glm::dvec3(world_from_view[3]), glm::normalize(glm::dvec3(world_from_view * toward))};
}

glm::dvec3 CenterOf(const Scene& scene, size_t i) {
  return glm::dvec3(scene.particles->positions[i]) +
         scene.time_offset_s * glm::dvec3(scene.particles->velocities[i]);
}

double DepthOn(const Scene& scene, size_t i, const Ray& ray) {
  const double b = glm::length(glm::cross(CenterOf(scene, i) - ray.origin, ray.direction));
  const double rho = b / static_cast<double>(scene.particles->radii[i]);
  if (rho >= 1.0) return 0.0;
  const float opacity = std::min(scene.particles->opacities[i], kMaxOpacity);
  const double tau = -std::log(1.0 - static_cast<double>(opacity));
  return tau *
         (scene.material.profile == Profile::kSoft ? 1.0 - rho * rho : std::sqrt(1.0 - rho * rho));
}

glm::dvec3 TransmittanceAt(const Scene& scene, const Light& light, size_t i, const glm::dvec3& x) {
  const auto* point = std::get_if<PointLight>(&light.kind);
  const auto nearness = [&](size_t j) {
    return point != nullptr
               ? glm::distance(CenterOf(scene, j), point->position)
               : glm::dot(CenterOf(scene, j), std::get<DirectionalLight>(light.kind).direction);
  };
  const Ray ray = point != nullptr ? Ray{point->position, glm::normalize(x - point->position)}
                                   : Ray{x, std::get<DirectionalLight>(light.kind).direction};
  double sum = 0.0;
  for (size_t j = 0; j < scene.particles->size(); ++j) {
    const bool nearer = nearness(j) < nearness(i) || (nearness(j) == nearness(i) && j < i);
    if (!nearer) continue;
    if (point != nullptr && glm::dot(CenterOf(scene, j) - ray.origin, ray.direction) <= 0.0) {
      continue;
    }
    sum += DepthOn(scene, j, ray);
  }
  return glm::exp(-glm::dvec3(light.shadow_density) * sum);
}

glm::dvec3 RadianceAt(const Scene& scene, const Light& light, const glm::dvec3& x,
                      const glm::dvec3& view) {
  const auto* point = std::get_if<PointLight>(&light.kind);
  const glm::dvec3 travel = point != nullptr ? glm::normalize(x - point->position)
                                             : std::get<DirectionalLight>(light.kind).direction;
  const double g = scene.material.phase_g;
  const double phase =
      (1.0 - g * g) / std::pow(1.0 + g * g + 2.0 * g * glm::dot(travel, view), 1.5);
  const double falloff = point != nullptr && point->inverse_square_falloff
                             ? 1.0 / std::pow(glm::distance(x, point->position), 2.0)
                             : 1.0;
  return glm::dvec3(light.color) * phase * falloff;
}

// Adds one sample, its depth and transmittance weighted by coverage.
void AddSample(const Scene& scene, const Ray& ray, BruteForcePixel& pixel) {
  const auto distance = [&](size_t i) {
    return glm::dot(CenterOf(scene, i) - ray.origin, ray.direction);
  };
  std::vector<size_t> order(scene.particles->size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return distance(a) < distance(b); });
  double clear = 1.0;
  for (const size_t i : order) {
    if (distance(i) <= 0.0 || DepthOn(scene, i, ray) == 0.0) continue;
    const glm::dvec3 x = ray.origin + distance(i) * ray.direction;
    const double alpha = 1.0 - std::exp(-DepthOn(scene, i, ray));
    glm::dvec3 light_at(scene.material.ambient);
    for (size_t l = 0; l < scene.lights.size(); ++l) {
      const glm::dvec3 transmittance = TransmittanceAt(scene, scene.lights[l], i, x);
      pixel.transmittance[l] += clear * alpha * transmittance;
      light_at += RadianceAt(scene, scene.lights[l], x, ray.direction) * transmittance;
    }
    const glm::dvec3 color =
        glm::dvec3(scene.particles->colors[i]) * glm::dvec3(scene.material.albedo) * light_at +
        glm::dvec3(scene.particles->emissions[i]);
    pixel.rgba += clear * alpha * glm::dvec4(color, 1.0);
    pixel.depth += clear * alpha * -(scene.camera.view_from_world * glm::dvec4(x, 1.0)).z;
    clear *= 1.0 - alpha;
  }
}

}  // namespace

BruteForcePixel RenderByBruteForce(const Scene& scene, const glm::ivec2& pixel) {
  const int n = scene.sampling.supersample;
  BruteForcePixel mean;
  mean.transmittance.resize(scene.lights.size());
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      AddSample(scene,
                RayAt(scene.camera, scene.camera.window.x + pixel.x + (column + 0.5) / n,
                      scene.camera.window.y + pixel.y + (row + 0.5) / n),
                mean);
    }
  }
  mean.depth /= mean.rgba.a;
  for (glm::dvec3& transmittance : mean.transmittance) transmittance /= mean.rgba.a;
  mean.rgba /= static_cast<double>(n * n);
  return mean;
}

}  // namespace halflight::reference
