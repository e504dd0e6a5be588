// The light sweep on the CPU against the same in float64, which is written down on its own.
#include "renderer/sweep/light_fit.h"

#include <gtest/gtest.h>

#include "tests/renderer/test_scene.h"
#include "tests/sweep/fitted_light.h"

namespace halflight::sweep {
namespace {

struct Case {
  const char* name;
  bool point;
  Profile profile;
};

class FitLightOf : public testing::TestWithParam<Case> {};

// Where a texel lies against a sprite is known to some 1e-5 of the smallest sprites' radius, which
// tells most at the steep rim of a ball. A fit of degree 6 makes 20 times as much of it.
TEST_P(FitLightOf, IsThatOfFloat64) {
  Scene scene = test::BallScene(800);
  test::VaryParticles(scene, 0.1F, 0.4F);
  scene.material.profile = GetParam().profile;
  if (GetParam().point) scene.lights[0].kind = PointLight{{1.5, 2.0, 1.0}, false};
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    scene.shadow.fit_degree = degree;
    const FitDifference difference = Between(FitOnCpu(scene), FitInFloat64(scene), degree);
    EXPECT_LT(difference.rms, 1e-5) << degree;
    EXPECT_LT(difference.largest, 1e-3) << degree;
    EXPECT_LT(difference.behind, 1e-4) << degree;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, FitLightOf,
                         testing::Values(Case{"Sun", false, Profile::kSoft},
                                         Case{"SunAndBalls", false, Profile::kBall},
                                         Case{"Point", true, Profile::kSoft},
                                         Case{"PointAndBalls", true, Profile::kBall}),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace halflight::sweep
