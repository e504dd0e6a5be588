#include "renderer/sweep/light_slabs.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include "renderer/parallel.h"
#include "renderer/projection.h"

namespace halflight::sweep {

LightWay::LightWay(const Light& light, const ParticleView& particles)
    : particles_(particles),
      direction_(TravelDirection(light, particles)),
      center_(particles.bounds().center()) {
  if (const auto* const point = std::get_if<PointLight>(&light.kind)) {
    point_ = true;
    light_ = point->position - particles.set().origin;
    center_distance_ = glm::distance(center_, light_);
  }
}

double LightWay::operator()(uint32_t particle) const {
  const glm::dvec3 place(particles_.positions()[particle]);
  return point_ ? glm::distance(place, light_) - center_distance_
                : glm::dot(place - center_, direction_);
}

UniformSlabs CutLightUniformly(const LightWay& way, std::span<const uint32_t> order, int slabs) {
  UniformSlabs cut;
  cut.begin.assign(static_cast<size_t>(slabs) + 1, static_cast<uint32_t>(order.size()));
  cut.begin[0] = 0;
  cut.places.resize(order.size());
  const double front = order.empty() ? 0.0 : way(order.front());
  const double depth = order.empty() ? 0.0 : way(order.back()) - front;
  // The order is of rounded depths: what rounding put a hair before a slab stays in it.
  size_t slab = 0;
  for (size_t k = 0; k < order.size(); ++k) {
    const double at =
        depth > 0.0 ? std::clamp((way(order[k]) - front) / depth, 0.0, 1.0) * slabs : 0.0;
    const auto mine = std::min(static_cast<size_t>(at), static_cast<size_t>(slabs) - 1);
    while (slab < mine) cut.begin[++slab] = static_cast<uint32_t>(k);
    cut.places[k] = static_cast<float>(std::clamp(at - static_cast<double>(slab), 0.0, 1.0));
  }
  return cut;
}

SlabPositions PlaceSlabs(const LightWay& way, std::span<const uint32_t> order,
                         std::span<const uint32_t> begin) {
  const size_t slabs = begin.size() - 1;
  SlabPositions positions;
  positions.middle.resize(slabs);
  RunOnCores(slabs, [&](size_t s) {
    double sum = 0.0;
    for (size_t k = begin[s]; k < begin[s + 1]; ++k) sum += way(order[k]);
    positions.middle[s] = sum / std::max(1U, begin[s + 1] - begin[s]);
  });
  for (size_t s = 1; s < slabs; ++s) {
    if (begin[s] == begin[s + 1]) positions.middle[s] = positions.middle[s - 1];
  }
  if (!order.empty()) positions.end = way(order.back());
  return positions;
}

}  // namespace halflight::sweep
