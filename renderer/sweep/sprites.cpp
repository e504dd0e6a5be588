#include "renderer/sweep/sprites.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "renderer/parallel.h"
#include "renderer/sort.h"

namespace halflight::sweep {

namespace {

// Radii from the plane through the eye within which a particle may reach it, as rounding goes.
constexpr double kLeastNearDepth = 1.0005;

// TangentSlopes where the disc reaches w <= 0: only what lies at w > 0 counts.
glm::dvec2 VisibleSlopes(double x, double w, double r) {
  constexpr double kInfinity = 1e30;
  constexpr double kHalfPi = 0.5 * std::numbers::pi;
  const double distance = std::hypot(x, w);
  if (distance <= r) return {-kInfinity, kInfinity};
  const double middle = std::atan2(x, w);
  const double half_angle = std::asin(r / distance);
  const auto slope = [](double angle) {
    if (angle <= -kHalfPi) return -kInfinity;
    return angle >= kHalfPi ? kInfinity : std::tan(angle);
  };
  return {slope(middle - half_angle), slope(middle + half_angle)};
}

Rect RectOf(const Projection& target, const glm::dvec2& xs, const glm::dvec2& ys) {
  const glm::dvec2 a = glm::dvec2(xs.x, ys.y) * target.pixel_from_plane + target.pixel_offset;
  const glm::dvec2 b = glm::dvec2(xs.y, ys.x) * target.pixel_from_plane + target.pixel_offset;
  // Pixels whose centres may be inside, with a little more against rounding.
  const glm::dvec2 size(target.size);
  const glm::dvec2 low = glm::clamp(glm::floor(a - 0.501) + 1.0, glm::dvec2(0.0), size);
  const glm::dvec2 high = glm::clamp(glm::floor(b - 0.499) + 1.0, glm::dvec2(0.0), size);
  if (!(low.x < high.x && low.y < high.y)) return {};
  return {static_cast<uint16_t>(low.x), static_cast<uint16_t>(high.x), static_cast<uint16_t>(low.y),
          static_cast<uint16_t>(high.y)};
}

}  // namespace

SpriteList ListSprites(const ParticleView& particles, const Projection& target, double near_depth) {
  near_depth = std::max(near_depth, kLeastNearDepth);
  const size_t count = particles.size();
  const glm::dmat3 rotation(target.view_from_world);
  const glm::dvec3 origin_from_eye = particles.set().origin - target.eye();
  const auto view_of = [&](size_t i) {
    return rotation * (glm::dvec3(particles.positions()[i]) + origin_from_eye);
  };

  // Sort by depth.
  Block<uint32_t> keys(count);
  std::atomic<bool> has_near = false;
  ParallelRanges(count, [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end; ++i) {
      const glm::dvec3 view = view_of(i);
      if (-view.z <= near_depth * particles.radius(i)) has_near = true;
      keys[i] =
          OrderedKey(static_cast<float>(target.orthographic ? -view.z : glm::dot(view, view)));
    }
  });
  SpriteList list;
  list.particles = SortedOrder(keys);

  // Project.
  list.sprites.resize(count);
  list.rects.resize(count);
  if (has_near && !target.orthographic) list.near.resize(count);
  ParallelRanges(count, [&](const WorkRange& range) {
    for (size_t place = range.begin; place < range.end; ++place) {
      const uint32_t i = list.particles[place];
      const glm::dvec3 view = view_of(i);
      const double w = -view.z;
      double radius = particles.radius(i);
      double optical_depth = particles.optical_depth(i);
      // Particles smaller than a light buffer can show are enlarged, and keep their integral.
      const double least = target.least_radius * (target.orthographic ? 1.0 : std::max(w, 0.0));
      if (radius < least) {
        optical_depth *= (radius / least) * (radius / least);
        radius = least;
      }
      if (target.orthographic) {
        if (w <= 0.0) continue;
        list.sprites[place] = {static_cast<float>(view.x), static_cast<float>(view.y),
                               static_cast<float>(1.0 / radius), static_cast<float>(optical_depth)};
        list.rects[place] = RectOf(target, view.x + glm::dvec2(-radius, radius),
                                   view.y + glm::dvec2(-radius, radius));
      } else if (w > near_depth * radius) {
        list.sprites[place] = {static_cast<float>(view.x / w), static_cast<float>(view.y / w),
                               static_cast<float>(w / radius), static_cast<float>(optical_depth)};
        list.rects[place] =
            RectOf(target, TangentSlopes(view.x, w, radius), TangentSlopes(view.y, w, radius));
      } else if (w > -radius) {
        list.sprites[place] = {0.0F, 0.0F, 0.0F, static_cast<float>(optical_depth)};
        list.near[place] = {{static_cast<float>(view.x / radius),
                             static_cast<float>(view.y / radius),
                             static_cast<float>(view.z / radius)}};
        list.rects[place] =
            w > kLeastNearDepth * radius
                ? RectOf(target, TangentSlopes(view.x, w, radius), TangentSlopes(view.y, w, radius))
                : RectOf(target, VisibleSlopes(view.x, w, radius),
                         VisibleSlopes(view.y, w, radius));
      }
    }
  });
  return list;
}

PixelGrid GridFrom(const Projection& target, int x, int y) {
  const glm::dvec2 step = 1.0 / target.pixel_from_plane;
  const glm::dvec2 first = (glm::dvec2(x, y) - target.pixel_offset) * step;
  return {static_cast<float>(first.x), static_cast<float>(first.y), static_cast<float>(step.x),
          static_cast<float>(step.y)};
}

}  // namespace halflight::sweep
