// Physical scattering in the light buffer: what it does not depend on, and its limits. How true it
// is, tests/monte_carlo says.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

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

  // Root mean square of the difference of two images.
  static double Difference(const Image& a, const Image& b) {
    double squares = 0.0;
    for (size_t i = 0; i < a.pixels.size(); ++i) {
      squares += std::pow(static_cast<double>(a.pixels[i]) - b.pixels[i], 2);
    }
    return std::sqrt(squares / static_cast<double>(a.pixels.size()));
  }

  // Settings that should not matter change the image by little beside what scattering does, most of
  // which they do without scattering too.
  static void ExpectNoChange(const Scene& scene, const ShadowSettings& one,
                             const ShadowSettings& other) {
    const auto render = [](Scene changed, const ShadowSettings& settings, bool scatters) {
      changed.shadow = settings;
      if (!scatters) changed.material.physical_scattering.reset();
      return RenderBeauty(changed);
    };
    const Image scattered = render(scene, other, true);
    const Image plain = render(scene, other, false);
    const double effect = Difference(scattered, plain);
    const double change = Difference(render(scene, one, true), scattered);
    const double without = Difference(render(scene, one, false), plain);
    std::cout << "scattering changes the image by " << effect << ", the settings by " << change
              << ", and without scattering by " << without << "\n";
    EXPECT_LT(change, without + 0.03 * effect);
  }
};

TEST_F(PhysicalScatteringOf, ABallDoesNotDependOnTheNumberOfSlices) {
  const Scene scene = Ball();
  ShadowSettings few = scene.shadow;
  few.slices = 32;
  ShadowSettings many = scene.shadow;
  many.slices = 256;
  ExpectNoChange(scene, few, many);
}

TEST_F(PhysicalScatteringOf, ABallDoesNotDependOnTheResolutionOfTheLightBuffer) {
  const Scene scene = Ball();
  ShadowSettings coarse = scene.shadow;
  coarse.light_buffer_size = 64;
  ShadowSettings fine = scene.shadow;
  fine.light_buffer_size = 256;
  ExpectNoChange(scene, coarse, fine);
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
  const Image scattered = RenderBeauty(scene);
  scene.material.physical_scattering.reset();
  scene.lights[0].shadow_density = glm::vec3(0.25F);
  EXPECT_LT(Difference(scattered, RenderBeauty(scene)), 2e-3);
}

TEST_F(PhysicalScatteringOf, AFaintCloudKeepsItsDigits) {
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
  const Image directional = RenderBeauty(scene);
  scene.lights[0].kind = PointLight{{0.0, 0.0, 2000.0}};
  EXPECT_LT(Difference(directional, RenderBeauty(scene)), 0.001);
}

}  // namespace
}  // namespace halflight
