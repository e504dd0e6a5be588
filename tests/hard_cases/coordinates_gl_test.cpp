// The same cloud elsewhere, and in other units.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/hard_cases/hard_case.h"
#include "tests/hard_cases/same_picture.h"

namespace halflight {
namespace {

// Directional and point light, seen along -z: the camera's matrix holds no rounded numbers.
Scene TwoLitBall() {
  Scene scene = test::BallScene(600, 48);
  scene.lights.push_back(test::Lamp({2.0, 1.0, 2.0}));
  std::get<PointLight>(scene.lights[1].kind).inverse_square_falloff = true;
  return scene;
}

class Coordinates : public test::HardCase {
 protected:
  // Holds each technique's frame of `same` to that of `scene`.
  static void HoldSame(const std::string& subject, Scene scene, Scene same, double allowed) {
    for (const auto technique :
         {ShadowTechniqueKind::kHalfAngle, ShadowTechniqueKind::kReference}) {
      scene.shadow.technique = same.shadow.technique = technique;
      test::ExpectAtMost(
          subject,
          std::string("largest change of the image, ") +
              (technique == ShadowTechniqueKind::kHalfAngle ? "HALF_ANGLE" : "REFERENCE"),
          test::MaxDifference(RenderBeauty(same), RenderBeauty(scene)), allowed);
    }
  }

  static void HoldSameBits(const std::string& subject, const Scene& scene, const Scene& same) {
    test::ExpectAtMost(subject, "floats that differ in any bit",
                       test::DifferentFloats(RenderBeauty(same), RenderBeauty(scene)), 0.0);
  }
};

TEST_F(Coordinates, MovedByWhatFloat64HoldsGiveTheSameBits) {
  const double far = 0x1p23;  // 8.4e6
  HoldSameBits("moved by 2^23", TwoLitBall(), test::Moved(TwoLitBall(), {far, -far, far}));
}

TEST_F(Coordinates, MovedByTenMillionGiveTheSameImage) {
  HoldSame("moved by 1e7", TwoLitBall(), test::Moved(TwoLitBall(), {1e7, -1e7 / 3.0, 1e7 / 7.0}),
           1e-6);
}

TEST_F(Coordinates, ScaledByPowersOfTwoGiveTheSameBits) {
  for (const int exponent : {20, -20}) {
    HoldSameBits("scaled by 2^" + std::to_string(exponent), TwoLitBall(),
                 test::Scaled(TwoLitBall(), std::ldexp(1.0, exponent)));
  }
}

TEST_F(Coordinates, ScaledByAMillionBothWaysGiveTheSameImage) {
  HoldSame("scaled by 1e6", TwoLitBall(), test::Scaled(TwoLitBall(), 1e6), 2e-6);
  HoldSame("scaled by 1e-6", TwoLitBall(), test::Scaled(TwoLitBall(), 1e-6), 2e-6);
}

}  // namespace
}  // namespace halflight
