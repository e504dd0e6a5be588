// A light's particles cut across its way, at which the light may spread and layers are kept.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/particle_view.h"
#include "renderer/scene.h"

namespace halflight::sweep {

// How far along a light's way particles lie: world units behind the centre of the particles'
// bounds, along the light, or of a point light in distance from it.
class LightWay {
 public:
  LightWay(const Light& light, const ParticleView& particles);
  [[nodiscard]] double operator()(uint32_t particle) const;

 private:
  const ParticleView& particles_;
  bool point_ = false;
  glm::dvec3 direction_{0.0};  // of travel
  glm::dvec3 light_{0.0};      // a point light, from the set's origin
  glm::dvec3 center_{0.0};     // of the bounds
  double center_distance_ = 0.0;
};

// Slabs of one thickness from the first particle to the last, `order` having those nearest the
// light first. As of CutIntoSlices, slab s is places [begin[s], begin[s + 1]) of the order; some
// may be empty.
struct UniformSlabs {
  std::vector<uint32_t> begin;
  // Where within its slab each place of the order lies: 0 at its front to 1 at its back.
  std::vector<float> places;
};
UniformSlabs CutLightUniformly(const LightWay& way, std::span<const uint32_t> order, int slabs);

// Where slabs lie along the light's way.
struct SlabPositions {
  // The mean of a slab's particles; an empty one lies where the one before it does.
  std::vector<double> middle;
  double end = 0.0;  // of the last particle
};
SlabPositions PlaceSlabs(const LightWay& way, std::span<const uint32_t> order,
                         std::span<const uint32_t> begin);

}  // namespace halflight::sweep
