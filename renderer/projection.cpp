#include "renderer/projection.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/matrix.hpp>

#include "renderer/parallel.h"

namespace halflight {

namespace {

// Radii below this many texels leave gaps between texel centres; from here on the sum over texels
// varies by less than 10 % as the particle moves.
constexpr double kLeastRadiusTexels = 1.5;
// Bilinear filtering reaches half a texel, an enlarged particle kLeastRadiusTexels.
constexpr double kBorderTexels = kLeastRadiusTexels + 1.0;

struct PlaneBounds {
  glm::dvec2 low{std::numeric_limits<double>::infinity()};
  glm::dvec2 high{-std::numeric_limits<double>::infinity()};

  void Include(const glm::dvec2& a, const glm::dvec2& b) {
    low = glm::min(low, a);
    high = glm::max(high, b);
  }
};

// A rigid view from `position` along `direction`, with +y of the world upward, or +x where the
// direction leaves y no say.
glm::dmat4 ViewAlong(const glm::dvec3& position, const glm::dvec3& direction) {
  const glm::dvec3 world_up =
      std::abs(direction.y) > 0.999 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(direction, world_up));
  const glm::dvec3 up = glm::cross(right, direction);
  glm::dmat4 view(1.0);
  view = glm::row(view, 0, glm::dvec4(right, -glm::dot(right, position)));
  view = glm::row(view, 1, glm::dvec4(up, -glm::dot(up, position)));
  view = glm::row(view, 2, glm::dvec4(-direction, glm::dot(direction, position)));
  return view;
}

PlaneBounds BoundsInPlane(const Projection& projection, const ParticleView& particles) {
  if (particles.size() == 0) return {glm::dvec2(-1.0), glm::dvec2(1.0)};
  std::vector<PlaneBounds> by_worker(WorkerCount(particles.size()));
  const glm::dmat3 rotation(projection.view_from_world);
  const glm::dvec3 origin_from_eye = particles.set().origin - projection.eye();
  ParallelRanges(particles.size(), [&](const WorkRange& range) {
    PlaneBounds bounds;
    for (size_t i = range.begin; i < range.end; ++i) {
      const glm::dvec3 view = rotation * (glm::dvec3(particles.positions()[i]) + origin_from_eye);
      const double radius = particles.radius(i);
      if (projection.orthographic) {
        bounds.Include(glm::dvec2(view) - radius, glm::dvec2(view) + radius);
      } else {
        const double w = std::max(-view.z, radius * (1.0 + 1e-6));
        const glm::dvec2 xs = TangentSlopes(view.x, w, radius);
        const glm::dvec2 ys = TangentSlopes(view.y, w, radius);
        bounds.Include({xs.x, ys.x}, {xs.y, ys.y});
      }
    }
    by_worker[range.worker] = bounds;
  });
  PlaneBounds bounds = by_worker[0];
  for (const PlaneBounds& part : by_worker) bounds.Include(part.low, part.high);
  return bounds;
}

// Whether any particle, its radius times `enlarged`, reaches the plane through `point` across the
// unit vector `forward`.
bool ReachesPlane(const glm::dvec3& point, const glm::dvec3& forward, double enlarged,
                  const ParticleView& particles) {
  const double origin_depth = glm::dot(forward, particles.set().origin - point);
  std::atomic<bool> reaches = false;
  ParallelRanges(particles.size(), [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end && !reaches; ++i) {
      const double depth = origin_depth + glm::dot(forward, glm::dvec3(particles.positions()[i]));
      if (depth < enlarged * particles.radius(i)) reaches = true;
    }
  });
  return reaches;
}

}  // namespace

glm::dvec2 TangentSlopes(double x, double w, double r) {
  const double reach = r * std::sqrt(x * x + (w - r) * (w + r));
  return glm::dvec2(x * w - reach, x * w + reach) / ((w - r) * (w + r));
}

glm::dmat4 Projection::texture_from_world() const {
  const glm::dvec2 scale = pixel_from_plane / glm::dvec2(size);
  const glm::dvec2 offset = pixel_offset / glm::dvec2(size);
  glm::dmat4 texture_from_view(0.0);
  if (orthographic) {
    texture_from_view[0][0] = scale.x;
    texture_from_view[1][1] = scale.y;
    texture_from_view[3] = glm::dvec4(offset, 0.0, 1.0);
    texture_from_view[2][2] = -1.0;
  } else {
    texture_from_view[0][0] = scale.x;
    texture_from_view[1][1] = scale.y;
    texture_from_view[2] = glm::dvec4(-offset, -1.0, -1.0);
  }
  return texture_from_view * view_from_world;
}

glm::dvec3 Projection::eye() const {
  return -glm::transpose(glm::dmat3(view_from_world)) * glm::dvec3(view_from_world[3]);
}

shader::ProjectionBlock Projection::block(const ParticleView& particles) const {
  const glm::dvec3 eye_from_origin = eye() - particles.set().origin;
  // The place among the particles that is nearest the eye, in float32 as the shader has it.
  const glm::vec3 near(
      glm::clamp(eye_from_origin, particles.bounds().low, particles.bounds().high));
  shader::ProjectionBlock block;
  block.view_from_world = glm::mat4(glm::mat3(view_from_world));
  block.near_translation = glm::vec4(-near, 0.0F);
  block.far_translation =
      glm::vec4(glm::dmat3(view_from_world) * (glm::dvec3(near) - eye_from_origin), 0.0F);
  block.pixel_from_plane = glm::vec4(pixel_from_plane, pixel_offset);
  block.plane_from_pixel = glm::vec4(1.0 / pixel_from_plane, -pixel_offset / pixel_from_plane);
  block.target_size = glm::vec4(size, least_radius, optical_depth_scale);
  block.band = glm::vec4(0.0F, 0.0F, size);
  return block;
}

Projection EyeProjection(const Camera& camera, const glm::ivec2& target_size, double samples) {
  Projection projection;
  projection.view_from_world = camera.view_from_world;
  projection.size = target_size;
  double half_height = 0.0;  // of the whole image, plane units
  if (const auto* perspective = std::get_if<Perspective>(&camera.projection)) {
    half_height = std::tan(0.5 * perspective->vertical_fov);
  } else {
    projection.orthographic = true;
    half_height = 0.5 * std::get<Orthographic>(camera.projection).height;
  }
  const double pixels_per_unit = 0.5 * camera.height / half_height;
  projection.pixel_from_plane = samples * glm::dvec2(pixels_per_unit, -pixels_per_unit);
  projection.pixel_offset = samples * glm::dvec2(0.5 * camera.width - camera.window.x,
                                                 0.5 * camera.height - camera.window.y);
  return projection;
}

Projection EyeProjection(const Scene& scene, const glm::ivec2& composite_size) {
  const Sampling& sampling = scene.sampling;
  return EyeProjection(
      scene.camera, composite_size,
      static_cast<double>(sampling.supersample) / static_cast<double>(sampling.downsample));
}

glm::dvec3 ViewDirection(const Camera& camera) {
  return -glm::normalize(glm::dvec3(glm::row(camera.view_from_world, 2)));
}

bool ReachesEyePlane(const Projection& projection, const ParticleView& particles) {
  const glm::dvec3 forward = -glm::dvec3(glm::row(projection.view_from_world, 2));
  return ReachesPlane(projection.eye(), forward, 1.001, particles);
}

bool LiesAmong(const Light& light, const ParticleView& particles) {
  const auto* point = std::get_if<PointLight>(&light.kind);
  return point != nullptr &&
         ReachesPlane(point->position, TravelDirection(light, particles), 1.0, particles);
}

glm::dvec3 TravelDirection(const Light& light, const ParticleView& particles) {
  if (const auto* directional = std::get_if<DirectionalLight>(&light.kind)) {
    return directional->direction;
  }
  const auto& point = std::get<PointLight>(light.kind);
  const glm::dvec3 to_center =
      (particles.set().origin - point.position) + particles.bounds().center();
  const double largest =
      std::max({std::abs(to_center.x), std::abs(to_center.y), std::abs(to_center.z)});
  // Scaled first, so that the squares do not vanish.
  return largest > 0.0 ? glm::normalize(to_center / largest) : glm::dvec3(0.0, -1.0, 0.0);
}

Projection LightProjection(const Light& light, const ParticleView& particles, int size,
                           double spread) {
  const glm::dvec3 direction = TravelDirection(light, particles);
  const auto* point = std::get_if<PointLight>(&light.kind);
  // A directional light looks from behind all particles, so that all lie in front of it.
  const glm::dvec3 center = particles.bounds().center();
  const double reach = glm::length(particles.bounds().high - center) +
                       static_cast<double>(particles.largest_radius());
  Projection projection;
  projection.orthographic = point == nullptr;
  projection.size = glm::ivec2(size);
  projection.view_from_world =
      ViewAlong(point != nullptr ? point->position
                                 : particles.set().origin + center - direction * (1.01 * reach),
                direction);

  const PlaneBounds bounds = BoundsInPlane(projection, particles);
  const glm::dmat3 rotation(projection.view_from_world);
  const double center_depth =
      -(rotation * (center + (particles.set().origin - projection.eye()))).z;
  // Slopes from a point light; no particles are at no depth.
  const double widen =
      projection.orthographic || particles.size() == 0 ? spread : spread / center_depth;
  const glm::dvec2 low = bounds.low - widen;
  const glm::dvec2 high = bounds.high + widen;
  const glm::dvec2 texels_per_unit = (size - 2.0 * kBorderTexels) / (high - low);
  projection.pixel_from_plane = texels_per_unit * glm::dvec2(1.0, -1.0);
  projection.pixel_offset = glm::dvec2(kBorderTexels - low.x * texels_per_unit.x,
                                       kBorderTexels + high.y * texels_per_unit.y);
  projection.least_radius = kLeastRadiusTexels / std::min(texels_per_unit.x, texels_per_unit.y);
  return projection;
}

}  // namespace halflight
