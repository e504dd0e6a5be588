// Physical scattering in the light buffer: what it does not depend on, and its limits. How true it
// is, tests/monte_carlo says.
#include <gtest/gtest.h>

#include <cmath>

#include "renderer/scattering.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

class PhysicalScatteringOf : public test::GlTest {
 protected:
  // A ball of particles, lit and seen from the same side.
  static Scene Ball() {
    Scene scene = test::BallScene(4000);
    scene.lights = {test::Sun({0, 0, -1})};
    scene.material.physical_scattering = PhysicalScattering{0.8F, 0.9F};
    scene.shadow.slices = 64;
    return scene;
  }

  static Image Buffer(const Scene& scene) {
    return Render({scene, {{ImageKind::kLightBuffer}}}).images.at(0);
  }

  // Root mean square of the difference of two light buffers, one of which may be finer.
  static double Difference(const Image& coarse, const Image& fine) {
    const int step = fine.width / coarse.width;
    double squares = 0.0;
    for (int y = 0; y < coarse.height; ++y) {
      for (int x = 0; x < coarse.width; ++x) {
        double mean = 0.0;
        for (int k = 0; k < step * step; ++k) {
          mean += *test::PixelAt(fine, step * x + k % step, step * y + k / step);
        }
        squares += std::pow(*test::PixelAt(coarse, x, y) - mean / (step * step), 2);
      }
    }
    return std::sqrt(squares / (coarse.width * coarse.height));
  }
};

TEST_F(PhysicalScatteringOf, ABallDoesNotDependOnTheNumberOfSlices) {
  Scene scene = Ball();
  scene.shadow.slices = 32;
  const Image few = Buffer(scene);
  scene.shadow.slices = 256;
  const Image many = Buffer(scene);
  scene.material.physical_scattering.reset();
  const double effect = Difference(Buffer(scene), many);
  EXPECT_GT(effect, 0.1);
  EXPECT_LT(Difference(few, many), 0.03 * effect);
}

TEST_F(PhysicalScatteringOf, ABallDoesNotDependOnTheResolutionOfTheLightBuffer) {
  Scene scene = Ball();
  scene.shadow.light_buffer_size = 128;
  const Image coarse = Buffer(scene);
  scene.shadow.light_buffer_size = 512;
  const Image fine = Buffer(scene);
  scene.shadow.light_buffer_size = 128;
  scene.material.physical_scattering.reset();
  EXPECT_LT(Difference(coarse, fine), 0.05 * Difference(Buffer(scene), coarse));
}

TEST_F(PhysicalScatteringOf, NoAlbedoIsAbsorptionAlone) {
  Scene scene = Ball();
  scene.material.physical_scattering->albedo = 0.0F;
  const Image absorbed = Buffer(scene);
  scene.material.physical_scattering.reset();
  EXPECT_EQ(test::MaxDifference(absorbed, Buffer(scene)), 0.0);
}

// Sharp scattering spreads nothing, and loses next to nothing.
TEST_F(PhysicalScatteringOf, LightStraightAheadIsAbsorptionByTheRest) {
  Scene scene = Ball();
  scene.material.physical_scattering = PhysicalScattering{0.99999F, 0.75F};
  const Image scattered = Buffer(scene);
  scene.material.physical_scattering.reset();
  scene.lights[0].shadow_density = glm::vec3(0.25F);
  EXPECT_LT(Difference(scattered, Buffer(scene)), 2e-3);
}

TEST_F(PhysicalScatteringOf, FaintCloudsKeepsItsDigits) {
  Scene scene = Ball();
  scene.material.opacity = 1e-6F;
  const FrameRequest depth{scene, {{ImageKind::kLightBuffer, 0, LightQuantity::kOpticalDepth}}};
  const Image scattered = Render(depth).images.at(0);
  FrameRequest plain = depth;
  plain.scene.material.physical_scattering.reset();
  const Image whole = Render(plain).images.at(0);
  // What light loses in all: the share that is not scattered ahead, spread or not.
  double lost = 0.0;
  double met = 0.0;
  for (size_t i = 0; i < whole.pixels.size(); ++i) {
    lost += scattered.pixels[i];
    met += whole.pixels[i];
  }
  EXPECT_NEAR(lost / met, ForwardExtinction({0.8F, 0.9F}), 0.02);
}

TEST_F(PhysicalScatteringOf, AnyMediumKeepsLightBetweenNoneAndAll) {
  Scene scene = Ball();
  scene.shadow.slices = 8;
  for (const float opacity : {0.01F, 0.999F}) {
    for (const float g : {0.0F, 0.5F, 0.99F}) {
      scene.material.opacity = opacity;
      scene.material.physical_scattering = PhysicalScattering{g, 1.0F};
      for (const float value : Buffer(scene).pixels) {
        ASSERT_GE(value, 0.0F);
        ASSERT_LE(value, 1.0F);
      }
    }
  }
}

TEST_F(PhysicalScatteringOf, ColoursIsThatOfTheirOwnDensities) {
  Scene scene = Ball();
  scene.lights[0].shadow_density = {0.5F, 1.0F, 3.0F};
  const Image colored = Buffer(scene);
  for (int c = 0; c < 3; ++c) {
    Scene grey = scene;
    grey.lights[0].shadow_density = glm::vec3(scene.lights[0].shadow_density[c]);
    // The border that scattered light is given follows the colour that spreads most.
    const Image one = Buffer(grey);
    double colored_sum = 0.0;
    double grey_sum = 0.0;
    for (size_t i = 0; i < one.pixels.size(); ++i) {
      colored_sum += 1.0 - colored.pixels[3 * i + static_cast<size_t>(c)];
      grey_sum += 1.0 - one.pixels[i];
    }
    EXPECT_NEAR(colored_sum / grey_sum, 1.0, 0.1) << c;
  }
}

TEST_F(PhysicalScatteringOf, AFarPointLightIsThatOfADirectionalOne) {
  Scene scene = Ball();
  const Image directional = Buffer(scene);
  scene.lights[0].kind = PointLight{{0.0, 0.0, 2000.0}};
  EXPECT_LT(Difference(directional, Buffer(scene)), 0.01);
}

}  // namespace
}  // namespace halflight
