// What the renderer reads of a particle set in one frame: positions at the frame's time, and
// attributes with the material's values filled in. Refers to the scene, which must outlive it.
#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/scene.h"

namespace halflight {

// An axis-aligned box of offsets from the set's origin.
struct OffsetBounds {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};

  [[nodiscard]] glm::dvec3 center() const { return (low + high) * 0.5; }
};

class ParticleView {
 public:
  explicit ParticleView(const Scene& scene);

  [[nodiscard]] size_t size() const { return positions_->size(); }
  [[nodiscard]] const ParticleSet& set() const { return *set_; }
  // Offsets from set().origin.
  [[nodiscard]] const std::vector<glm::vec3>& positions() const { return *positions_; }
  [[nodiscard]] float radius(size_t i) const {
    return set_->radii.empty() ? uniform_radius_ : set_->radii[i];
  }
  // -ln(1 - opacity) at the centre.
  [[nodiscard]] float optical_depth(size_t i) const {
    return optical_depths_.empty() ? uniform_optical_depth_ : optical_depths_[i];
  }
  // Empty where all particles have uniform_optical_depth().
  [[nodiscard]] const std::vector<float>& optical_depths() const { return optical_depths_; }
  [[nodiscard]] float uniform_optical_depth() const { return uniform_optical_depth_; }
  [[nodiscard]] float uniform_radius() const { return uniform_radius_; }
  // Particles whose opacity was above kMaxOpacity.
  [[nodiscard]] size_t clamped_opacities() const { return clamped_opacities_; }
  // Of the centres; zero for an empty set.
  [[nodiscard]] const OffsetBounds& bounds() const { return bounds_; }

 private:
  const ParticleSet* set_;
  std::vector<glm::vec3> advanced_positions_;
  const std::vector<glm::vec3>* positions_;
  float uniform_radius_;
  float uniform_optical_depth_;
  std::vector<float> optical_depths_;
  size_t clamped_opacities_ = 0;
  OffsetBounds bounds_;
};

}  // namespace halflight
