// The eye's part: which particles a pixel's ray meets, and how they blend, in float64.
// What light reaches a particle is handed in as functions.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "renderer/reference/cloud.h"
#include "renderer/reference/eye.h"
#include "renderer/reference/ray_index.h"
#include "renderer/reference/rays.h"
#include "renderer/scene.h"

namespace halflight::reference {

// Optical depth from the light to the point x of a particle. Where it is above `enough`, anything
// above will do.
using DepthFromLight = std::function<double(const glm::dvec3& x, uint32_t particle, double enough)>;

struct PassLight {
  size_t index;  // in the scene
  Light light;
  Rays rays;             // from the set's origin, as the cloud's centres
  DepthFromLight depth;  // none: everything arrives
};

// One walk over a pixel's particles from the nearest to the farthest, which adds some light.
struct Pass {
  std::vector<uint32_t> nearness;  // by particle, 0 nearest; empty: by the distance of x_i
  bool ambient_and_emission = false;
  std::vector<PassLight> lights;
};

// What one ray, or the mean of a pixel's, shows.
struct PixelSample {
  glm::dvec4 rgba{0.0};
  double depth = 0.0;                     // mean weighted by coverage, times coverage
  std::vector<glm::dvec3> transmittance;  // by light, likewise
};

// The particles as an eye's rays meet them. Of some of the particles only, soon after `stop` was
// requested.
struct EyeIndex {
  EyeIndex(const Rays& rays, const Cloud& cloud, const std::stop_token& stop);

  [[nodiscard]] size_t bytes() const { return order.size() * sizeof(order[0]) + index.bytes(); }

  std::vector<uint32_t> order;  // of the index: nearest first
  RayIndex index;
};

// A camera, and the index of its rays.
struct IndexedEye {
  IndexedEye(const Scene& scene, const Cloud& cloud, const std::stop_token& stop);
  IndexedEye(const Eye& camera, std::shared_ptr<const EyeIndex> indexed)
      : eye(camera), particles(std::move(indexed)) {}

  Eye eye;
  std::shared_ptr<const EyeIndex> particles;
};

class Compositor {
 public:
  // Adds up the passes; coverage and depth come from the first of them. `cloud` must outlive this.
  Compositor(const Scene& scene, const Cloud& cloud, IndexedEye eye, std::vector<Pass> passes);

  // The mean over a pixel's samples; `pixel` is a place in the camera's window. Leaves out, from
  // each sample, what cannot change it by more than 1e-10. Some value, soon after `stop` was
  // requested. Any thread.
  [[nodiscard]] PixelSample Evaluate(const glm::ivec2& pixel, const std::stop_token& stop) const;

  // Of the scene.
  [[nodiscard]] size_t light_count() const { return light_count_; }

 private:
  struct Hit;
  class Blending;

  void FindHits(const EyeRay& ray, std::vector<Hit>& hits) const;
  void AddSample(const EyeRay& ray, std::vector<Hit>& hits, PixelSample& sum,
                 const std::stop_token& stop) const;

  const Cloud& cloud_;
  std::vector<Pass> passes_;
  std::vector<std::vector<float>> brightest_;  // by pass, particle: bounds on what it can add
  size_t light_count_;
  Material material_;
  PixelRect window_;
  int samples_across_;
  IndexedEye eye_;
};

}  // namespace halflight::reference
