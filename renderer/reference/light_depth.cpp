// Adds up particles along a light's ray; see light_depth.h.
#include "renderer/reference/light_depth.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include "renderer/reference/sorted_order.h"

namespace halflight::reference {

LightDepth::LightDepth(const Rays& rays, const Cloud& cloud, const std::vector<uint32_t>& order,
                       const std::stop_token& stop)
    : profile_(cloud.profile), index_(rays, cloud, order, stop), ranks_(order.size()) {
  for (size_t rank = 0; rank < order.size(); ++rank) {
    ranks_[order[rank]] = static_cast<uint32_t>(rank);
  }
  const size_t entries = index_.ranks().size();
  for (std::vector<double>* column :
       {&columns_.x, &columns_.y, &columns_.inverse_square_radius, &columns_.optical_depth}) {
    column->reserve(entries);
  }
  if (!rays.parallel()) columns_.z.reserve(entries);
  constexpr size_t kBetweenStops = 65536;
  for (size_t entry = 0; entry < entries; ++entry) {
    if (entry % kBetweenStops == 0 && stop.stop_requested()) return;
    const Particle& particle = cloud.particles[order[index_.ranks()[entry]]];
    if (rays.parallel()) {
      columns_.x.push_back(glm::dot(particle.center, index_.axis_u()));
      columns_.y.push_back(glm::dot(particle.center, index_.axis_v()));
    } else {
      const glm::dvec3 offset = particle.center - rays.vector();
      columns_.x.push_back(offset.x);
      columns_.y.push_back(offset.y);
      columns_.z.push_back(offset.z);
    }
    columns_.inverse_square_radius.push_back(1.0 / (particle.radius * particle.radius));
    columns_.optical_depth.push_back(particle.optical_depth);
  }
}

double LightDepth::Between(const glm::dvec3& x, uint32_t begin, uint32_t end, double enough) const {
  const Rays& rays = index_.rays();
  // At the light itself no ray is defined, and nothing lies before it.
  if (begin >= end || (!rays.parallel() && x == rays.vector())) return 0.0;
  const glm::dvec2 place(glm::dot(x, index_.axis_u()), glm::dot(x, index_.axis_v()));
  const glm::dvec3 direction = rays.DirectionAt(x);
  double sum = 0.0;
  index_.VisitCandidates(x, [&](uint32_t first, uint32_t last) {
    if (sum > enough) return;
    const auto ranks = index_.ranks().begin();
    const auto from =
        begin == 0 ? ranks + first : std::lower_bound(ranks + first, ranks + last, begin);
    const auto to = std::lower_bound(from, ranks + last, end);
    const auto from_entry = static_cast<size_t>(from - ranks);
    const auto to_entry = static_cast<size_t>(to - ranks);
    sum += rays.parallel()
               ? SumAcross(columns_, profile_, from_entry, to_entry, place, enough - sum)
               : SumFromPoint(columns_, profile_, from_entry, to_entry, direction, enough - sum);
  });
  return sum;
}

size_t LightDepth::bytes() const {
  const size_t columns = index_.rays().parallel() ? 4 : 5;
  return index_.bytes() + columns * columns_.x.size() * sizeof(double) +
         ranks_.size() * sizeof(ranks_[0]);
}

std::vector<uint32_t> OrderFromLight(const Rays& rays, const Cloud& cloud,
                                     const std::stop_token& stop) {
  std::vector<double> nearness;
  nearness.reserve(cloud.particles.size());
  for (const Particle& particle : cloud.particles) {
    nearness.push_back(rays.NearnessOf(particle.center));
  }
  return SortedOrder(nearness, stop);
}

}  // namespace halflight::reference
