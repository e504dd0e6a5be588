// The light's sideways spread: how wide it is, and what it does not depend on.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/renderer/gl_fixture.h"
#include "tests/renderer/scattering_column.h"

namespace halflight {
namespace {

class Blur : public test::GlTest {
 protected:
  // The camera looks at right angles to the light.
  static Scene Column() { return test::ScatteringColumn({0, 5, 0.001}); }

  static double Width(const Scene& scene) { return test::BeamWidth(Render(test::BeamOf(scene))); }
};

TEST_F(Blur, IsAsWideWithSixteenSlicesAsWithTwoHundredAndFiftySix) {
  Scene scene = Column();
  scene.shadow.slices = 16;
  const double coarse = Width(scene);
  scene.shadow.slices = 256;
  const double fine = Width(scene);
  RecordProperty("width_16_over_256", std::to_string(coarse / fine));
  EXPECT_NEAR(coarse / fine, 1.0, 0.03);
}

TEST_F(Blur, HasTheVarianceOfItsDistance) {
  Scene scene = Column();
  scene.shadow.slices = 256;
  const double blurred = Width(scene);
  scene.material.scattering_spread = 0.0F;
  const double sharp = Width(scene);
  // 2 world units of travel at 0.15 a unit.
  EXPECT_NEAR(std::sqrt(blurred * blurred - sharp * sharp), 0.15 * std::sqrt(2.0), 0.005);
}

TEST_F(Blur, DoesNotDependOnTheResolutionOfTheLightBuffer) {
  Scene scene = Column();
  scene.shadow.light_buffer_size = 128;
  const double coarse = Width(scene);
  scene.shadow.light_buffer_size = 512;
  EXPECT_NEAR(coarse / Width(scene), 1.0, 0.03);
}

TEST_F(Blur, OfTexelsPerSliceFollowsTheSlicesAsThePublishedSampleDoes) {
  Scene scene = Column();
  scene.material.scattering_spread = 0.0F;
  scene.shadow.blur_mode = BlurMode::kTexelsPerSlice;
  scene.shadow.blur_texels = 1.0F;
  scene.shadow.slices = 16;
  const double few = Width(scene);
  scene.shadow.slices = 128;
  EXPECT_GT(Width(scene), 1.8 * few);
}

TEST_F(Blur, OfAnyWidthEndsAndKeepsTheLight) {
  Scene scene = test::BallScene(300);
  scene.shadow.slices = 4;
  for (const float spread : {1.0F, 100.0F, 1e30F}) {
    scene.material.scattering_spread = spread;
    const Image image = Render({scene, {{ImageKind::kLightBuffer}}}).images[0];
    for (const float value : image.pixels) {
      ASSERT_GE(value, 0.0F);
      ASSERT_LE(value, 1.0F);
    }
  }
}

TEST_F(Blur, InStridesHasTheVarianceOfOnePass) {
  Scene scene = Column();
  scene.shadow.slices = 2;
  scene.shadow.light_buffer_size = 1024;  // 2 units at 0.15: a deviation of about 50 texels
  const double strided = Width(scene);
  scene.shadow.light_buffer_size = 128;  // and here of 6
  EXPECT_NEAR(strided / Width(scene), 1.0, 0.02);
}

TEST_F(Blur, LetsLightIntoTheShadow) {
  // Behind a wide dark screen the middle stays dark and the edge brightens.
  Scene scene = test::BallScene(3000);
  scene.material.opacity = 0.5F;
  scene.lights = {test::Sun({0, 0, 1})};
  const auto mean_transmittance = [&] {
    const Image image = Render({scene, {{ImageKind::kLightBuffer}}}).images[0];
    double sum = 0.0;
    for (const float value : image.pixels) sum += value;
    return sum / static_cast<double>(image.pixels.size());
  };
  const double sharp = mean_transmittance();
  scene.material.scattering_spread = 0.3F;
  EXPECT_GT(mean_transmittance(), sharp + 0.02);
}

TEST_F(Blur, TreatsEveryColourByItsOwnDensity) {
  Scene scene = Column();
  auto dark = std::make_shared<ParticleSet>(*scene.particles);
  dark->opacities[0] = 0.9F;
  scene.particles = dark;
  scene.lights[0].shadow_density = {1.0F, 1.0F, 3.0F};
  const Image colored = Render({scene, {{ImageKind::kLightBuffer}}}).images[0];
  scene.lights[0].shadow_density = glm::vec3(3.0F);
  const Image grey = Render({scene, {{ImageKind::kLightBuffer}}}).images[0];
  double red_below = 0.0;
  for (size_t i = 0; i < grey.pixels.size(); ++i) {
    ASSERT_EQ(colored.pixels[3 * i], colored.pixels[3 * i + 1]);
    ASSERT_NEAR(colored.pixels[3 * i + 2], grey.pixels[i], 1e-5);
    red_below += colored.pixels[3 * i] - colored.pixels[3 * i + 2];
  }
  EXPECT_GT(red_below, 0.0);
}

}  // namespace
}  // namespace halflight
