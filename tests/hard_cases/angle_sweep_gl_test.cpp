// The light carried round the cloud from behind the camera to straight into it, degree by degree.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/hard_cases/hard_case.h"
#include "tests/oracle/image_error.h"
#include "tests/oracle/oracle.h"
#include "tests/oracle/plume.h"

namespace halflight {
namespace {

// Every sixteenth particle of the plume, seen along -z.
Scene ThinnedPlume() {
  Scene scene;
  scene.particles = oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  if (scene.particles == nullptr) return scene;
  std::vector<glm::vec3>& positions = test::EditParticles(scene).positions;
  for (size_t i = 0; 16 * i < positions.size(); ++i) positions[i] = positions[16 * i];
  positions.resize((positions.size() + 15) / 16);
  scene.camera = test::LookAt({0, 1.25, 4.6}, {0, 1.25, 0}, 40, 40);
  scene.material.radius = 0.11F;
  scene.material.opacity = 0.3F;
  scene.shadow.slices = 64;
  scene.shadow.light_buffer_size = 256;
  return scene;
}

// The angle's cosine and sine, exact where they are whole.
Light LightAt(int degrees) {
  const double cosine = degrees == 90 ? 0.0 : std::cos(degrees * test::kDegree);
  const double sine = degrees % 180 == 0 ? 0.0 : std::sin(degrees * test::kDegree);
  Light light;
  light.kind = DirectionalLight{{sine, 0.0, -cosine}};
  return light;
}

// R, G and B of the covered pixels at one angle, drawn and exact.
struct Frame {
  std::vector<double> drawn;
  std::vector<double> exact;
};

// Root of the mean square of `value(i)`.
template <typename Value>
double Rms(size_t count, const Value& value) {
  double squares = 0.0;
  for (size_t i = 0; i < count; ++i) squares += std::pow(value(i), 2);
  return std::sqrt(squares / static_cast<double>(count));
}

class AngleSweep : public test::HardCase {};

TEST_F(AngleSweep, JumpsNowhereButWhereTheAxisFlips) {
  Scene scene = ThinnedPlume();
  ASSERT_NE(scene.particles, nullptr);
  std::vector<Frame> frames;
  double slicing_error = 0.0;
  double brightness = 0.0;
  for (int degrees = 0; degrees <= 180; ++degrees) {
    scene.lights = {LightAt(degrees)};
    const Image image = RenderBeauty(scene);
    const oracle::OracleImage exact = oracle::RenderExact(scene);
    slicing_error = std::max(
        slicing_error, oracle::CompareColor(image, oracle::RenderHalfAngle(scene)).relative_rmse);
    Frame& frame = frames.emplace_back();
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      if (i % 4 == 3 || exact.rgba[i / 4].a <= 0.01) continue;
      frame.drawn.push_back(image.pixels[i]);
      frame.exact.push_back(exact.rgba[i / 4][static_cast<glm::length_t>(i % 4)]);
      brightness += frame.exact.back();
    }
  }
  const size_t values = frames[0].drawn.size();
  brightness /= static_cast<double>(values * frames.size());

  std::vector<double> exact_jumps;
  double steepest = 0.0;   // jump that the model does not make, over the neighbours' larger error
  double elsewhere = 0.0;  // the largest such jump
  double flip = 0.0;
  double flip_error = 0.0;
  for (size_t k = 1; k < frames.size(); ++k) {
    const Frame& a = frames[k - 1];
    const Frame& b = frames[k];
    const auto error_of = [&](const Frame& f) {
      return Rms(values, [&](size_t i) { return f.drawn[i] - f.exact[i]; });
    };
    const double own_error = std::max(error_of(a), error_of(b));
    const double jump = Rms(
        values, [&](size_t i) { return (b.drawn[i] - a.drawn[i]) - (b.exact[i] - a.exact[i]); });
    exact_jumps.push_back(Rms(values, [&](size_t i) { return b.exact[i] - a.exact[i]; }));
    if (k == 90) {  // from 89 to 90 degrees
      flip = jump;
      flip_error = own_error;
    } else {
      steepest = std::max(steepest, jump / own_error);
      elsewhere = std::max(elsewhere, jump);
    }
  }
  const std::string subject = "light swept 0 to 180 degrees";
  test::ExpectAtMost(subject, "colour from exact slicing, relative RMSE", slicing_error, 0.006);
  // Neighbours whose errors have nothing to do with one another come to the root of 2.
  test::ExpectAtMost(subject, "jump between neighbours over their own error", steepest, 1.5);
  test::ExpectAtMost(subject, "jump between neighbours, relative RMSE", elsewhere / brightness,
                     0.12);
  test::ExpectAtMost(subject, "jump at the axis flip over the neighbours' error", flip / flip_error,
                     2.0);
  test::ExpectAtMost(subject, "jump at the axis flip, relative RMSE", flip / brightness, 1.0);
  const double largest = *std::max_element(exact_jumps.begin(), exact_jumps.end());
  std::nth_element(exact_jumps.begin(), exact_jumps.begin() + 90, exact_jumps.end());
  test::ExpectAtMost(subject, "reference: largest step over the median step",
                     largest / exact_jumps[90], 2.0);
}

}  // namespace
}  // namespace halflight
