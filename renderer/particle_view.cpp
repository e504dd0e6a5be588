#include "renderer/particle_view.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <glm/common.hpp>

#include "renderer/parallel.h"

namespace halflight {

namespace {

// tau = -ln(1 - a) (image model), in float64, where the difference keeps its digits.
float OpticalDepth(float opacity) {
  return static_cast<float>(-std::log1p(-static_cast<double>(std::min(opacity, kMaxOpacity))));
}

OffsetBounds BoundsOf(const std::vector<glm::vec3>& positions) {
  if (positions.empty()) return {};
  std::vector<OffsetBounds> by_worker(WorkerCount(positions.size()));
  ParallelRanges(positions.size(), [&](const WorkRange& range) {
    glm::vec3 low = positions[range.begin];
    glm::vec3 high = low;
    for (size_t i = range.begin; i < range.end; ++i) {
      low = glm::min(low, positions[i]);
      high = glm::max(high, positions[i]);
    }
    by_worker[range.worker] = {low, high};
  });
  OffsetBounds bounds = by_worker[0];
  for (const OffsetBounds& part : by_worker) {
    bounds.low = glm::min(bounds.low, part.low);
    bounds.high = glm::max(bounds.high, part.high);
  }
  return bounds;
}

}  // namespace

ParticleViewKey ParticleViewKeyOf(const Scene& scene) {
  return {scene.time_offset_s, scene.material.radius, scene.material.opacity};
}

ParticleView::ParticleView(const Scene& scene)
    : set_(scene.particles.get()),
      uniform_radius_(scene.material.radius),
      uniform_optical_depth_(OpticalDepth(scene.material.opacity)),
      largest_radius_(set_->radii.empty()
                          ? uniform_radius_
                          : *std::max_element(set_->radii.begin(), set_->radii.end())) {
  const size_t count = set_->size();
  if (scene.time_offset_s != 0.0) {
    advanced_positions_.resize(count);
    const auto seconds = static_cast<float>(scene.time_offset_s);
    ParallelRanges(count, [&](const WorkRange& range) {
      for (size_t i = range.begin; i < range.end; ++i) {
        advanced_positions_[i] = set_->positions[i] + set_->velocities[i] * seconds;
      }
    });
  }
  if (set_->opacities.empty()) {
    clamped_opacities_ = scene.material.opacity > kMaxOpacity ? count : 0;
  } else {
    optical_depths_.resize(count);
    std::atomic<size_t> clamped = 0;
    ParallelRanges(count, [&](const WorkRange& range) {
      size_t clamped_here = 0;
      for (size_t i = range.begin; i < range.end; ++i) {
        optical_depths_[i] = OpticalDepth(set_->opacities[i]);
        clamped_here += set_->opacities[i] > kMaxOpacity ? 1 : 0;
      }
      clamped += clamped_here;
    });
    clamped_opacities_ = clamped;
  }
  bounds_ = BoundsOf(positions());
}

}  // namespace halflight
