// Where lights stand, of what colour they are, and how finely their shadows are drawn.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/hard_cases/hard_case.h"
#include "tests/oracle/image_error.h"
#include "tests/oracle/oracle.h"

namespace halflight {
namespace {

class Lighting : public test::HardCase {
 protected:
  // Of half-angle slicing, from the same with an ideal light buffer.
  static double SlicingError(const Scene& scene) {
    return oracle::CompareColor(RenderBeauty(scene), oracle::RenderHalfAngle(scene)).relative_rmse;
  }
};

Scene LampLitBall(const glm::dvec3& position) {
  Scene scene = test::BallScene(1000, 40);
  scene.shadow.light_buffer_size = 512;
  scene.lights = {test::Lamp(position)};
  return scene;
}

TEST_F(Lighting, FromAPointNearAndFar) {
  Hold("point light 0.2 off the cloud", LampLitBall({0.9, 0.9, 0.5}), {4e-6, 7e-4, 0.15, 1e-7});
  Hold("point light 1e6 away", LampLitBall({6e5, 6e5, 5e5}), {4e-6, 6e-4, 0.05, 1e-7});
}

TEST_F(Lighting, FromAPointFarAwayIsDirectional) {
  Scene scene = LampLitBall({6e5, 6e5, 5e5});
  const Image lamp = RenderBeauty(scene);
  scene.lights = {test::Sun({-6, -6, -5})};
  test::ExpectAtMost("point light 1e6 away", "from a directional light, largest",
                     test::MaxDifference(lamp, RenderBeauty(scene)), 3e-6);
}

TEST_F(Lighting, FromAPointInsideIsRefusedOrExact) {
  const Scene scene = LampLitBall({0.1, 0.2, 0.1});
  const absl::Status status = Renderer().Render(test::Beauty(scene), {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("lights[0].point.position: (0.1, 0.2, 0.1), allowed under "
                                  "technique HALF_ANGLE: outside"),
            std::string::npos)
      << status;
  HoldReference("point light inside the cloud", scene, 1e-7);
}

TEST_F(Lighting, OfLightBuffersFrom16To4096Texels) {
  Scene scene = test::BallScene(800, 40);
  scene.shadow.slices = 6;
  struct Size {
    int texels;
    double allowed;
  };
  for (const Size& size :
       {Size{16, 0.15}, {64, 0.013}, {256, 0.0015}, {1024, 2e-4}, {4096, 3e-5}}) {
    scene.shadow.light_buffer_size = size.texels;
    test::ExpectAtMost("light buffer of " + std::to_string(size.texels),
                       "colour from exact slicing, relative RMSE", SlicingError(scene),
                       size.allowed);
  }
}

TEST_F(Lighting, OfOneSliceToMoreThanThereAreParticles) {
  Scene scene = test::BallScene(301, 40);
  scene.shadow.light_buffer_size = 512;
  double largest = 0.0;
  for (const SliceSpacing spacing : {SliceSpacing::kEqualCount, SliceSpacing::kEqualOpticalDepth}) {
    for (const bool interpolate : {true, false}) {
      for (const int slices : {1, 2, 7, 150, 300, 301, 65536}) {
        scene.shadow.slices = slices;
        scene.shadow.spacing = spacing;
        scene.shadow.interpolate = interpolate;
        largest = std::max(largest, SlicingError(scene));
      }
    }
  }
  test::ExpectAtMost("slices 1 to N, and more than N", "colour from exact slicing, relative RMSE",
                     largest, 8e-4);
}

TEST_F(Lighting, OfColorsAboveOneIsProportional) {
  Scene scene = test::BallScene(500, 40);
  const Image plain = RenderBeauty(scene);
  scene.material.albedo = {2.0F, 8.0F, 1024.0F};
  const Image bright = RenderBeauty(scene);
  double largest = 0.0;
  for (size_t i = 0; i < plain.pixels.size(); ++i) {
    const float factor = i % 4 == 3 ? 1.0F : scene.material.albedo[static_cast<int>(i % 4)];
    largest = std::max(largest,
                       std::abs(static_cast<double>(bright.pixels[i]) / factor - plain.pixels[i]));
  }
  test::ExpectAtMost("colours above 1", "largest change once divided out", largest, 0.0);
  Hold("colours above 1", scene, {4e-6, 0.01, 0.08, 2e-5});
}

TEST_F(Lighting, OfColorsExactlyZeroIsExactlyBlack) {
  Scene scene = test::BallScene(500, 40);
  scene.material.albedo = glm::vec3(0.0F);
  const Image black = RenderBeauty(scene);
  Scene unlit = test::BallScene(500, 40);
  unlit.lights[0].color = glm::vec3(0.0F);
  unlit.material.ambient = glm::vec3(0.0F);
  const Image dark = RenderBeauty(unlit);
  float brightest = 0.0F;
  float covered = 0.0F;
  for (const Image& image : {black, dark}) {
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      float& most = i % 4 == 3 ? covered : brightest;
      most = std::max(most, std::abs(image.pixels[i]));
    }
  }
  EXPECT_GT(covered, 0.9F);
  test::ExpectAtMost("colours exactly 0", "brightest value", brightest, 0.0);
}

}  // namespace
}  // namespace halflight
