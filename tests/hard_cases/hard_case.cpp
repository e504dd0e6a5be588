// Evaluations of one scene in every way that there is; see hard_case.h.
#include "tests/hard_cases/hard_case.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "tests/hard_cases/same_picture.h"
#include "tests/oracle/image_error.h"
#include "tests/oracle/oracle.h"
#include "tests/reference/brute_force.h"

namespace halflight::test {

void HardCase::Hold(const std::string& subject, const Scene& scene, const Allowed& allowed) {
  const Image image = RenderBeauty(scene);
  const oracle::OracleImage exact = oracle::RenderExact(scene);
  ASSERT_GT(*std::max_element(image.pixels.begin(), image.pixels.end()), 0.0F) << "shows nothing";
  ExpectAtMost(subject, "coverage from the model, largest",
               oracle::CompareCoverage(image, exact).max, allowed.coverage);
  ExpectAtMost(subject, "colour from exact slicing, relative RMSE",
               oracle::CompareColor(image, oracle::RenderHalfAngle(scene)).relative_rmse,
               allowed.slicing);
  ExpectAtMost(subject, "colour from the model, relative RMSE",
               oracle::CompareColor(image, exact).relative_rmse, allowed.model);
  HoldReference(subject, scene, allowed.reference);
}

void HardCase::HoldReference(const std::string& subject, const Scene& scene, double allowed) {
  Scene same = WithOwnAttributes(scene);
  same = Moved(same, -same.particles->origin);
  same.shadow.technique = ShadowTechniqueKind::kReference;
  const Image image = RenderBeauty(same);
  const auto pixels = static_cast<int>(image.pixels.size() / 4);
  double largest = 0.0;
  // Sixteen pixels, over the whole image.
  for (int k = 0; k < 16; ++k) {
    const int pixel = (2 * k + 1) * pixels / 32 + (k % 4 - 2) * image.width / 8;
    const glm::ivec2 place(pixel % image.width, pixel / image.width);
    const glm::dvec4 loops = reference::RenderByBruteForce(same, place).rgba;
    for (int c = 0; c < 4; ++c) {
      const double error = std::abs(PixelAt(image, place.x, place.y)[c] - loops[c]);
      largest = std::max(largest, std::isnan(error) ? HUGE_VAL : error);
    }
  }
  ExpectAtMost(subject, "reference from loops, largest", largest, allowed);
}

Light Lamp(const glm::dvec3& position) {
  Light light;
  light.kind = PointLight{position};
  return light;
}

ParticleSet& EditParticles(Scene& scene) {
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  ParticleSet& editable = *set;
  scene.particles = set;
  return editable;
}

double CoverageError(const Image& beauty, double expected) {
  double largest = 0.0;
  for (size_t i = 3; i < beauty.pixels.size(); i += 4) {
    largest = std::max(largest, std::abs(static_cast<double>(beauty.pixels[i]) - expected));
  }
  return largest;
}

double DifferentFloats(const Image& a, const Image& b) {
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  double different = 0.0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    if (std::memcmp(&a.pixels[i], &b.pixels[i], sizeof(float)) != 0) ++different;
  }
  return different;
}

}  // namespace halflight::test
