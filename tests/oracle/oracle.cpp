// Which walks each way of rendering takes, and what light reaches a particle in them.
// The walk itself is in composite.cpp.
#include "tests/oracle/oracle.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "tests/oracle/composite.h"
#include "tests/oracle/half_angle.h"
#include "tests/oracle/light_depth.h"

namespace halflight::oracle {
namespace {

Rays RaysOf(const Light& light, const Scene& scene) {
  if (const auto* sun = std::get_if<DirectionalLight>(&light.kind)) {
    return Rays::Along(sun->direction);
  }
  const glm::dvec3& position = std::get<PointLight>(light.kind).position;
  return Rays::From(scene.particles == nullptr ? position : position - scene.particles->origin);
}

glm::dvec3 Attenuate(const Light& light, double optical_depth) {
  return glm::exp(-glm::dvec3(light.shadow_density) * optical_depth);
}

std::vector<uint32_t> RanksOf(const std::vector<uint32_t>& order) {
  std::vector<uint32_t> ranks(order.size());
  for (size_t rank = 0; rank < order.size(); ++rank) {
    ranks[order[rank]] = static_cast<uint32_t>(rank);
  }
  return ranks;
}

// Particles by ascending value, ties by lower index.
std::vector<uint32_t> OrderBy(const std::vector<double>& values) {
  std::vector<uint32_t> order(values.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&values](uint32_t a, uint32_t b) { return values[a] < values[b]; });
  return order;
}

Transmittance ExactTransmittance(const Light& light, const Rays& rays, const Cloud& cloud) {
  std::vector<double> depths;
  for (const Particle& particle : cloud.particles) depths.push_back(rays.DepthOf(particle.center));
  const auto buffer = std::make_shared<LightDepth>(rays, cloud, OrderBy(depths));
  const auto ranks = std::make_shared<std::vector<uint32_t>>(RanksOf(buffer->order()));
  return [light, buffer, ranks](const glm::dvec3& x, uint32_t particle) {
    const uint32_t rank = (*ranks)[particle];
    return Attenuate(light, buffer->At(x, rank, rank, rank).before);
  };
}

Transmittance SlicedTransmittance(const Light& light, const Rays& rays, const Cloud& cloud,
                                  const HalfAngleOrder& order, bool interpolate) {
  const auto buffer = std::make_shared<LightDepth>(rays, cloud, order.order);
  const auto ranks = std::make_shared<std::vector<uint32_t>>(RanksOf(order.order));
  return [=, places = order.places](const glm::dvec3& x, uint32_t particle) {
    const uint32_t rank = (*ranks)[particle];
    const SlicePlace& place = places[rank];
    const LightDepth::Sums sums =
        buffer->At(x, place.begin, interpolate ? place.end : place.begin, rank);
    return Attenuate(light, sums.before + place.fraction * sums.within);
  };
}

// The walk for one light that casts shadows.
Pass HalfAnglePass(const Light& light, const Scene& scene, const Cloud& cloud) {
  const Rays rays = RaysOf(light, scene);
  const HalfAngleOrder order =
      OrderByHalfAngle(cloud, rays, ViewDirection(scene.camera), scene.shadow);
  Pass pass;
  pass.nearness = RanksOf(order.order);
  if (order.back_to_front) {
    for (uint32_t& rank : pass.nearness)
      rank = static_cast<uint32_t>(order.order.size()) - 1 - rank;
  }
  pass.lights.push_back(
      {light, rays, SlicedTransmittance(light, rays, cloud, order, scene.shadow.interpolate)});
  return pass;
}

// The walk of a scene without shadows.
Pass CenterDistancePass(const Scene& scene, const Cloud& cloud) {
  const glm::dvec3 eye = EyePosition(scene);
  const bool flat = std::holds_alternative<Orthographic>(scene.camera.projection);
  const Rays rays = flat ? Rays::Along(ViewDirection(scene.camera)) : Rays::From(eye);
  std::vector<double> distances;
  for (const Particle& particle : cloud.particles) {
    distances.push_back(rays.DepthOf(particle.center));
  }
  Pass pass;
  pass.nearness = RanksOf(OrderBy(distances));
  return pass;
}

}  // namespace

OracleImage RenderUnshadowed(const Scene& scene, const OracleOptions& options) {
  const Cloud cloud = ResolveCloud(scene);
  Pass pass{.nearness = {}, .ambient_and_emission = true, .lights = {}};
  for (const Light& light : scene.lights) {
    pass.lights.push_back({light, RaysOf(light, scene), nullptr});
  }
  return Composite(scene, cloud, {pass}, options);
}

OracleImage RenderExact(const Scene& scene, const OracleOptions& options) {
  const Cloud cloud = ResolveCloud(scene);
  Pass pass{.nearness = {}, .ambient_and_emission = true, .lights = {}};
  for (const Light& light : scene.lights) {
    const Rays rays = RaysOf(light, scene);
    pass.lights.push_back(
        {light, rays,
         light.casts_shadows() ? ExactTransmittance(light, rays, cloud) : Transmittance()});
  }
  return Composite(scene, cloud, {pass}, options);
}

OracleImage RenderHalfAngle(const Scene& scene, const OracleOptions& options) {
  const Cloud cloud = ResolveCloud(scene);
  std::vector<Pass> passes;
  for (const Light& light : scene.lights) {
    if (light.casts_shadows()) passes.push_back(HalfAnglePass(light, scene, cloud));
  }
  if (passes.empty()) passes.push_back(CenterDistancePass(scene, cloud));
  passes.front().ambient_and_emission = true;
  for (const Light& light : scene.lights) {
    if (!light.casts_shadows()) {
      passes.front().lights.push_back({light, RaysOf(light, scene), nullptr});
    }
  }
  return Composite(scene, cloud, passes, options);
}

}  // namespace halflight::oracle
