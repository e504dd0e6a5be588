#include "renderer/sweep/sprites.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "renderer/parallel.h"
#include "renderer/sort.h"

namespace halflight::sweep {

namespace {

// TangentSlopes of a disc that reaches both w > 0, of which alone it tells, and w <= 0, where a
// tangent bounds nothing. The tangents' directions are the centre's, turned by the angle whose sine
// is as r and whose cosine as their length.
glm::dvec2 VisibleSlopes(double x, double w, double r) {
  constexpr double kInfinity = 1e30;
  const double tangent_squared = x * x + (w - r) * (w + r);
  if (tangent_squared <= 0.0) return {-kInfinity, kInfinity};
  const double tangent = std::sqrt(tangent_squared);
  const glm::dvec2 low(x * tangent - w * r, w * tangent + x * r);
  const glm::dvec2 high(x * tangent + w * r, w * tangent - x * r);
  return {low.y > 0.0 ? low.x / low.y : -kInfinity, high.y > 0.0 ? high.x / high.y : kInfinity};
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

  // Particles smaller than a light buffer can show are enlarged.
  const auto drawn_radius = [&](size_t i, double w) {
    const double least = target.least_radius * (target.orthographic ? 1.0 : std::max(w, 0.0));
    return std::max<double>(particles.radius(i), least);
  };

  // Sort by depth.
  Block<uint32_t> keys(count);
  std::atomic<bool> has_near = false;
  ParallelRanges(count, [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end; ++i) {
      const glm::dvec3 view = view_of(i);
      if (-view.z <= near_depth * drawn_radius(i, -view.z)) has_near = true;
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
      const double radius = drawn_radius(i, w);
      // Enlarged particles keep their integral.
      const double shrink = particles.radius(i) / radius;
      const double optical_depth = particles.optical_depth(i) * (shrink * shrink);
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
