// What the renderer reads of a particle set in one frame: positions at the frame's time, and
// attributes with the material's values filled in. Refers to the set, which must outlive it.
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

class ParticleView;

// What a view of a particle set depends on besides the set; see FrameCache.
struct ParticleViewKey {
  using Value = ParticleView;
  double time_offset_s = 0.0;
  float radius = 0.0F;
  float opacity = 0.0F;

  bool operator==(const ParticleViewKey&) const = default;
};

ParticleViewKey ParticleViewKeyOf(const Scene& scene);

class ParticleView {
 public:
  explicit ParticleView(const Scene& scene);

  [[nodiscard]] size_t size() const { return positions().size(); }
  [[nodiscard]] const ParticleSet& set() const { return *set_; }
  // Offsets from set().origin.
  [[nodiscard]] const std::vector<glm::vec3>& positions() const {
    return advanced_positions_.empty() ? set_->positions : advanced_positions_;
  }
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
  // Largest radius of all; the uniform one for an empty set.
  [[nodiscard]] float largest_radius() const { return largest_radius_; }
  // Held beside the set.
  [[nodiscard]] size_t bytes() const {
    return advanced_positions_.capacity() * sizeof(glm::vec3) +
           optical_depths_.capacity() * sizeof(float);
  }

 private:
  const ParticleSet* set_;
  std::vector<glm::vec3> advanced_positions_;  // empty where they are the set's
  float uniform_radius_;
  float uniform_optical_depth_;
  std::vector<float> optical_depths_;
  size_t clamped_opacities_ = 0;
  OffsetBounds bounds_;
  float largest_radius_;
};

}  // namespace halflight
