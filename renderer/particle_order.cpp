#include "renderer/particle_order.h"

#include <algorithm>
#include <numeric>

#include <glm/geometric.hpp>

#include "renderer/parallel.h"
#include "renderer/sort.h"

namespace halflight {

namespace {

// Slice s ends before particle floor((s + 1) N / S): sizes differ by one at most, no remainder.
std::vector<uint32_t> CutByCount(size_t count, size_t slices) {
  std::vector<uint32_t> begin(slices + 1);
  for (size_t s = 0; s <= slices; ++s) begin[s] = static_cast<uint32_t>(count * s / slices);
  return begin;
}

// Each particle weighs its optical depth times its cross-section, and lies at the middle of its
// weight; slices divide the total weight evenly.
std::vector<uint32_t> CutByOpticalDepth(const ParticleView& particles,
                                        std::span<const uint32_t> order, size_t slices) {
  std::vector<double> weights(order.size());
  for (size_t k = 0; k < order.size(); ++k) {
    const double radius = particles.radius(order[k]);
    weights[k] = particles.optical_depth(order[k]) * radius * radius;
  }
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  if (total <= 0.0) return CutByCount(order.size(), slices);
  std::vector<uint32_t> begin(slices + 1, static_cast<uint32_t>(order.size()));
  begin[0] = 0;
  size_t slice = 0;
  double before = 0.0;
  for (size_t k = 0; k < order.size(); ++k) {
    const double middle = before + 0.5 * weights[k];
    before += weights[k];
    const auto mine =
        std::min(static_cast<size_t>(static_cast<double>(slices) * middle / total), slices - 1);
    while (slice < mine) begin[++slice] = static_cast<uint32_t>(k);
  }
  return begin;
}

// A particle's place is the share of its slice's other particles that come before it.
std::vector<shader::OrderedParticle> PlaceInSlices(const std::vector<uint32_t>& order,
                                                   const std::vector<uint32_t>& slice_begin) {
  std::vector<shader::OrderedParticle> placed(order.size());
  for (size_t s = 0; s + 1 < slice_begin.size(); ++s) {
    const uint32_t begin = slice_begin[s];
    const uint32_t end = slice_begin[s + 1];
    const float others = static_cast<float>(end - begin) - 1.0F;
    for (uint32_t k = begin; k < end; ++k) {
      placed[k] = {order[k], others > 0.0F ? static_cast<float>(k - begin) / others : 0.0F};
    }
  }
  return placed;
}

}  // namespace

std::vector<uint32_t> CutIntoSlices(const ParticleView& particles, std::span<const uint32_t> order,
                                    int slices, SliceSpacing spacing) {
  const size_t count = std::clamp<size_t>(order.size(), 1, static_cast<size_t>(slices));
  return spacing == SliceSpacing::kEqualCount || count == order.size()
             ? CutByCount(order.size(), count)
             : CutByOpticalDepth(particles, order, count);
}

ParticleOrder OrderParticles(const ParticleView& particles, const Traversal& traversal,
                             const glm::dvec3& eye) {
  const size_t count = particles.size();
  const std::vector<glm::vec3>& positions = particles.positions();
  const glm::dvec3 center = particles.bounds().center();
  std::vector<float> coordinate(count);
  std::vector<uint32_t> keys(count);
  ParallelRanges(count, [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end; ++i) {
      const glm::dvec3 position(positions[i]);
      coordinate[i] =
          static_cast<float>(traversal.axis ? glm::dot(position - center, *traversal.axis)
                                            : glm::distance(position, eye));
      keys[i] = OrderedKey(coordinate[i]);
    }
  });
  const std::vector<uint32_t> sorted = SortedOrder(keys);

  ParticleOrder order;
  order.slice_begin = CutIntoSlices(particles, sorted, traversal.slices, traversal.spacing);
  const size_t slices = order.slice_begin.size() - 1;
  order.particles = PlaceInSlices(sorted, order.slice_begin);
  if (traversal.axis) {
    order.slice_position.resize(slices);
    if (count > 0) order.end_position = coordinate[sorted.back()];
    for (size_t s = 0; s < slices; ++s) {
      const uint32_t begin = order.slice_begin[s];
      const uint32_t end = order.slice_begin[s + 1];
      double sum = 0.0;
      for (uint32_t k = begin; k < end; ++k) sum += coordinate[sorted[k]];
      order.slice_position[s] = end > begin ? sum / (end - begin)
                                : s > 0     ? order.slice_position[s - 1]
                                            : (count > 0 ? coordinate[sorted[0]] : 0.0);
    }
  }
  return order;
}

}  // namespace halflight
