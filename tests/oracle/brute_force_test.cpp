// Half-angle slicing of one particle a slice, against loops over all particles.
// Slices of several particles are left to oracle_test.cpp.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "tests/oracle/oracle.h"
#include "tests/reference/test_scenes.h"

namespace halflight::oracle {
namespace {

using reference::ExpectNear;
using reference::RandomScene;
using reference::RayOf;

// The image model's sums for one ray from the eye at (0, 0, 10), with nothing but loops.
struct BruteForce {
  const Scene& scene;
  glm::dvec3 eye{0.0, 0.0, 10.0};

  [[nodiscard]] glm::dvec3 Center(size_t i) const {
    return glm::dvec3(scene.particles->positions[i]) +
           scene.time_offset_s * glm::dvec3(scene.particles->velocities[i]);
  }
  // On the ray from `from` in direction d.
  [[nodiscard]] double OpticalDepth(size_t i, const glm::dvec3& from, const glm::dvec3& d) const {
    const double b = glm::length(glm::cross(Center(i) - from, d));
    const double rho = b / static_cast<double>(scene.particles->radii[i]);
    if (rho >= 1.0) return 0.0;
    const double tau = -std::log(1.0 - static_cast<double>(scene.particles->opacities[i]));
    return tau * (scene.material.profile == Profile::kSoft ? 1.0 - rho * rho
                                                           : std::sqrt(1.0 - rho * rho));
  }

  // `nearest_first` are the particles in the order of blending; `shadow(i, x)` the transmittances
  // of the scene's one light.
  template <typename Shadow>
  glm::dvec4 Blend(const glm::dvec3& d, const std::vector<size_t>& nearest_first,
                   const Shadow& shadow) const {
    const Light& light = scene.lights[0];
    glm::dvec4 sum(0.0);
    double clear = 1.0;
    for (const size_t i : nearest_first) {
      const glm::dvec3 x = eye + glm::dot(Center(i) - eye, d) * d;
      const auto* point = std::get_if<PointLight>(&light.kind);
      const glm::dvec3 travel = point != nullptr ? glm::normalize(x - point->position)
                                                 : std::get<DirectionalLight>(light.kind).direction;
      const double g = scene.material.phase_g;
      const double phase =
          (1.0 - g * g) / std::pow(1.0 + g * g + 2.0 * g * glm::dot(travel, d), 1.5);
      double falloff = 1.0;
      if (point != nullptr && point->inverse_square_falloff) {
        falloff = 1.0 / std::pow(glm::distance(x, point->position), 2.0);
      }
      const double alpha = 1.0 - std::exp(-OpticalDepth(i, eye, d));
      const glm::dvec3 color = glm::dvec3(scene.particles->colors[i]) *
                                   (glm::dvec3(scene.material.ambient) +
                                    glm::dvec3(light.color) * phase * falloff * shadow(i, x)) +
                               glm::dvec3(scene.particles->emissions[i]);
      sum += clear * alpha * glm::dvec4(color, 1.0);
      clear *= 1.0 - alpha;
    }
    return sum;
  }
};

std::vector<size_t> Sorted(size_t count, const std::function<double(size_t)>& key) {
  std::vector<size_t> order(count);
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&key](size_t a, size_t b) { return key(a) < key(b); });
  return order;
}

struct HalfAngleCase {
  const char* name;
  glm::dvec3 light_direction;
  Profile profile;
};

class OracleHalfAngle : public testing::TestWithParam<HalfAngleCase> {};

TEST_P(OracleHalfAngle, OneParticleASliceEqualsBruteForce) {
  Scene scene = RandomScene(60, 15);
  scene.material.profile = GetParam().profile;
  Light light;
  light.kind = DirectionalLight{glm::normalize(GetParam().light_direction)};
  light.shadow_density = {1.0F, 0.5F, 2.0F};
  scene.lights = {light};
  const size_t count = scene.particles->size();
  scene.shadow.slices = static_cast<int>(count);

  const BruteForce brute{scene};
  const glm::dvec3 l = glm::normalize(GetParam().light_direction);
  const glm::dvec3 v(0.0, 0.0, -1.0);
  const bool under = glm::dot(v, l) > 0.0;
  const glm::dvec3 h = glm::normalize(under ? v + l : l - v);
  const auto along = Sorted(count, [&](size_t i) { return glm::dot(brute.Center(i), h); });
  std::vector<size_t> nearest_first = along;
  if (!under) std::reverse(nearest_first.begin(), nearest_first.end());

  const OracleImage image = RenderHalfAngle(scene);
  for (size_t p = 0; p < image.pixels.size(); ++p) {
    const glm::dvec3 d = RayOf(scene, image.pixels[p]);
    const glm::dvec4 expected = brute.Blend(d, nearest_first, [&](size_t i, const glm::dvec3& x) {
      double sum = 0.0;
      for (const size_t j : along) {
        if (j == i) break;
        sum += brute.OpticalDepth(j, x, l);
      }
      return glm::exp(-glm::dvec3(light.shadow_density) * sum);
    });
    ExpectNear(image.rgba[p], expected, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(BothFlips, OracleHalfAngle,
                         testing::Values(HalfAngleCase{"Parallel", {0, 0, -1}, Profile::kSoft},
                                         HalfAngleCase{"Beside", {1, -0.5, -0.5}, Profile::kBall},
                                         HalfAngleCase{"Perpendicular", {0, -1, 0}, Profile::kSoft},
                                         HalfAngleCase{"Behind", {0.3, -0.5, 0.8}, Profile::kSoft},
                                         HalfAngleCase{"Antiparallel", {0, 0, 1}, Profile::kBall}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace halflight::oracle
