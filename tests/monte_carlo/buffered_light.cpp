// Samples each particle at points drawn from its extinction; see buffered_light.h.
#include "tests/monte_carlo/buffered_light.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "renderer/particle_order.h"
#include "tests/monte_carlo/random.h"

namespace halflight::monte_carlo {
namespace {

// Points in the ball of radius 1, the same for all particles.
std::vector<glm::dvec3> PointsInParticle(Profile profile) {
  constexpr size_t kPoints = 24;
  std::vector<glm::dvec3> points;
  Random random(5);
  while (points.size() < kPoints) {
    const double x = 2.0 * random.Uniform() - 1.0;
    const double y = 2.0 * random.Uniform() - 1.0;
    const glm::dvec3 point(x, y, 2.0 * random.Uniform() - 1.0);
    const double inside = 1.0 - glm::dot(point, point);
    const double keep = random.Uniform();
    if (inside > 0.0 && (profile == Profile::kBall || keep * keep < inside)) {
      points.push_back(point);
    }
  }
  return points;
}

// One layer of transmittance, filtered as a texture is.
double Sample(const Image& layers, size_t layer, const glm::dvec2& at) {
  const glm::ivec2 size(layers.width, layers.height);
  const glm::dvec2 place = at * glm::dvec2(size) - 0.5;
  const glm::ivec2 corner = glm::clamp(glm::ivec2(glm::floor(place)), glm::ivec2(0), size - 2);
  const glm::dvec2 t = glm::clamp(place - glm::dvec2(corner), 0.0, 1.0);
  const auto width = static_cast<size_t>(layers.width);
  const float* const row =
      &layers.pixels[(layer * static_cast<size_t>(layers.height) + static_cast<size_t>(corner.y)) *
                         width +
                     static_cast<size_t>(corner.x)];
  return glm::mix(glm::mix<double>(row[0], row[1], t.x),
                  glm::mix<double>(row[width], row[width + 1], t.x), t.y);
}

}  // namespace

std::vector<double> LightAtParticles(const Scene& scene, const FrameResult& frame) {
  const Image& layers = frame.images.at(0);
  const Traversal& traversal = frame.plan.traversals.at(0);
  const ParticleView particles(scene);
  const ParticleOrder order = OrderParticles(particles, traversal, {});
  const glm::dvec3 center = particles.bounds().center();
  const auto position_of = [&](const glm::dvec3& offset) {
    return glm::dot(offset - center, *traversal.axis);
  };
  const auto position_at = [&](size_t rank) {
    return position_of(particles.positions()[order.particles[rank].index]);
  };

  // A layer lies between the last particle of its slice and the first of the next.
  std::vector<double> places = {position_at(0)};
  for (size_t s = 1; s < order.slice_begin.size(); ++s) {
    const size_t end = order.slice_begin[s];
    const size_t next = std::min(end, particles.size() - 1);
    places.push_back(0.5 * (position_at(end - 1) + position_at(next)));
  }

  const std::vector<glm::dvec3> points = PointsInParticle(scene.material.profile);
  const glm::dmat4& texture = frame.lights.at(0).light_texture_from_world;
  std::vector<double> light(particles.size());
  for (size_t i = 0; i < particles.size(); ++i) {
    for (const glm::dvec3& point : points) {
      const glm::dvec3 offset =
          glm::dvec3(particles.positions()[i]) + static_cast<double>(particles.radius(i)) * point;
      const glm::dvec4 projected = texture * glm::dvec4(particles.set().origin + offset, 1.0);
      const glm::dvec2 at = glm::dvec2(projected) / projected.w;
      const double position = position_of(offset);
      const auto above = std::upper_bound(places.begin() + 1, places.end() - 1, position);
      const auto layer = static_cast<size_t>(above - places.begin()) - 1;
      const double t =
          std::clamp((position - places[layer]) / (places[layer + 1] - places[layer]), 0.0, 1.0);
      constexpr double kDarkest = 1e-30;
      const double before = layer == 0 ? 1.0 : std::max(Sample(layers, layer - 1, at), kDarkest);
      const double after = std::max(Sample(layers, layer, at), kDarkest);
      light[i] += std::pow(before, 1.0 - t) * std::pow(after, t);
    }
    light[i] /= static_cast<double>(points.size());
  }
  return light;
}

}  // namespace halflight::monte_carlo
