// Light that scatters between the slabs of the light sweep and of the particle shadow map: what it
// does not depend on, and half-angle slicing where both see the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>

#include "tests/oracle/plume.h"
#include "tests/renderer/gl_fixture.h"
#include "tests/renderer/scattering_column.h"

namespace halflight {
namespace {

constexpr auto kSweep = ShadowTechniqueKind::kLightSweep;
constexpr auto kLayered = ShadowTechniqueKind::kParticleShadowMap;

double RootMeanSquare(const Image& a, const Image& b) {
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  double squares = 0.0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    squares += std::pow(static_cast<double>(a.pixels[i]) - b.pixels[i], 2);
  }
  return std::sqrt(squares / static_cast<double>(a.pixels.size()));
}

Scene Column() { return test::ScatteringColumn({3, 5, 1}); }

// Looks along the light, whose rays are the camera's, at a plume that is thin enough for half-angle
// slicing to come near its limit.
Scene AlongTheLight() {
  static const std::shared_ptr<ParticleSet> plume =
      oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  Scene scene;
  scene.particles = plume;
  const glm::dvec3 travel = glm::normalize(glm::dvec3(1.0, -0.6, -0.4));
  scene.camera = test::LookAt(glm::dvec3(0, 1.25, 0) - 4.6 * travel, {0, 1.25, 0}, 64, 64);
  scene.camera.projection = Orthographic{3.2};
  scene.lights = {test::Sun(travel)};
  scene.material.radius = 0.045F;
  scene.material.opacity = 0.03F;
  scene.shadow.light_buffer_size = 160;
  scene.shadow.slices = 256;
  return scene;
}

class ScatteringIn : public test::GlTest, public testing::WithParamInterface<ShadowTechniqueKind> {
 protected:
  static Scene With(Scene scene) {
    scene.shadow.technique = GetParam();
    return scene;
  }

  static double Width(const Scene& scene) { return test::BeamWidth(Render(test::BeamOf(scene))); }
};

TEST_P(ScatteringIn, ABeamIsAsWideWithSixteenSlabsAsWithTwoHundredAndFiftySix) {
  Scene scene = With(Column());
  scene.shadow.slices = 16;
  const double coarse = Width(scene);
  scene.shadow.slices = 256;
  const double fine = Width(scene);
  std::cout << "16 slabs over 256: " << coarse / fine << "\n";
  EXPECT_NEAR(coarse / fine, 1.0, 0.03);
  scene.material.scattering_spread = 0.0F;
  // 2 world units of travel at 0.15 a unit.
  EXPECT_NEAR(std::sqrt(fine * fine - std::pow(Width(scene), 2)), 0.15 * std::sqrt(2.0), 0.005);
}

TEST_P(ScatteringIn, ABeamOfTexelsPerSliceFollowsTheSlabs) {
  Scene scene = With(Column());
  scene.material.scattering_spread = 0.0F;
  scene.shadow.blur_mode = BlurMode::kTexelsPerSlice;
  scene.shadow.blur_texels = 1.0F;
  scene.shadow.slices = 16;
  const double few = Width(scene);
  scene.shadow.slices = 128;
  EXPECT_GT(Width(scene), 1.8 * few);
}

struct Medium {
  const char* name;
  void (*change)(Scene&);
};

constexpr Medium kMedia[] = {
    {"artistic", [](Scene& s) { s.material.scattering_spread = 0.1F; }},
    {"artistic and coloured",
     [](Scene& s) {
       s.material.scattering_spread = 0.1F;
       s.lights[0].shadow_density = {0.3F, 1.0F, 2.0F};
     }},
    {"physical",
     [](Scene& s) {
       s.material.physical_scattering = PhysicalScattering{0.8F, 0.9F};
     }},
    {"physical and coloured",
     [](Scene& s) {
       s.material.physical_scattering = PhysicalScattering{0.5F, 0.9F};
       s.lights[0].shadow_density = {0.0F, 0.5F, 1.0F};
     }},
};

class ScatteringAlongTheView : public test::GlTest {};

// Half-angle slicing's axis is then the light's. What remains is what slices still lack, the fit,
// and how the two filter the buffer: without scattering they are as far apart.
TEST_F(ScatteringAlongTheView, IsThatOfManySlices) {
  const auto draw = [](Scene scene, ShadowTechniqueKind technique) {
    scene.shadow.technique = technique;
    return RenderBeauty(scene);
  };
  const Scene plain = AlongTheLight();
  const Image plain_sliced = draw(plain, ShadowTechniqueKind::kHalfAngle);
  const Image plain_swept = draw(plain, kSweep);
  for (const Medium& medium : kMedia) {
    Scene scene = plain;
    medium.change(scene);
    const Image sliced = draw(scene, ShadowTechniqueKind::kHalfAngle);
    const double effect = RootMeanSquare(plain_swept, sliced);
    for (const ShadowTechniqueKind technique : {kSweep, kLayered}) {
      const double off = RootMeanSquare(draw(scene, technique), sliced);
      const double without = RootMeanSquare(plain_swept, plain_sliced);
      std::cout << medium.name << (technique == kSweep ? ", sweep" : ", layered") << ": off by "
                << off << ", without scattering by " << without << ", scattering changes " << effect
                << "\n";
      EXPECT_LT(off, 1.5 * without) << medium.name;
      EXPECT_LT(off, 0.2 * effect) << medium.name;
    }
  }
}

TEST_P(ScatteringIn, APhysicalMediumDoesNotDependOnTheNumberOfSlabs) {
  Scene scene = With(test::BallScene(4000));
  scene.lights = {test::Sun({0.3, 0, -1})};
  scene.material.physical_scattering = PhysicalScattering{0.8F, 0.9F};
  const auto render = [&](int slices, bool scatters) {
    Scene changed = scene;
    changed.shadow.slices = slices;
    if (!scatters) changed.material.physical_scattering.reset();
    return RenderBeauty(changed);
  };
  const Image many = render(256, true);
  const double effect = RootMeanSquare(many, render(256, false));
  const double change = RootMeanSquare(many, render(32, true));
  const double without = RootMeanSquare(render(32, false), render(256, false));
  std::cout << "scattering changes " << effect << ", slabs " << change << ", without it " << without
            << "\n";
  EXPECT_LT(change, without + 0.06 * effect);
  EXPECT_LT(RootMeanSquare(many, render(128, true)), 0.4 * change);
}

TEST_P(ScatteringIn, LayersBeginsWithWhatTheFirstSlabMetAndEndsWithAll) {
  Scene scene = With(test::BallScene(2000));
  scene.shadow.slices = 24;
  const auto render = [&] {
    return Render({scene,
                   {{ImageKind::kBeauty},
                    {ImageKind::kLightLayers, 0, LightQuantity::kOpticalDepth},
                    {ImageKind::kLightBuffer, 0, LightQuantity::kOpticalDepth}}});
  };
  const FrameResult frame = render();
  const Image& layers = frame.images[1];
  ASSERT_EQ(layers.layers, 24);
  const size_t texels = frame.images[2].pixels.size();
  ASSERT_EQ(layers.pixels.size(), 24 * texels);
  for (size_t i = texels; i < layers.pixels.size(); ++i) {
    ASSERT_GE(layers.pixels[i], layers.pixels[i - texels]);
  }
  EXPECT_TRUE(std::equal(frame.images[2].pixels.begin(), frame.images[2].pixels.end(),
                         layers.pixels.end() - static_cast<ptrdiff_t>(texels)));
  EXPECT_GT(*std::max_element(layers.pixels.begin(),
                              layers.pixels.begin() + static_cast<ptrdiff_t>(texels)),
            0.0F);
  EXPECT_EQ(frame.lights[0].slices, 24);
  EXPECT_NEAR(glm::dot(frame.lights[0].slice_axis, glm::normalize(glm::dvec3(1, -1, -0.5))), 1.0,
              1e-12);
  EXPECT_FALSE(frame.lights[0].back_to_front);
  // Showing them changes nothing else.
  EXPECT_EQ(RenderBeauty(scene).pixels, frame.images[0].pixels);
  // Where light scatters and is coloured, three channels.
  scene.material.scattering_spread = 0.1F;
  scene.lights[0].shadow_density = {1.0F, 2.0F, 3.0F};
  EXPECT_EQ(render().images[1].channels.size(), 3U);
}

// Frames that follow find what they may, and nothing else.
TEST_P(ScatteringIn, FramesThatFollowIsNoMatterOfWhatWentBefore) {
  const Scene scene = With(test::BallScene(1000));
  void (*const changes[])(Scene&) = {
      [](Scene& s) { s.material.scattering_spread = 0.1F; },
      [](Scene& s) { s.material.scattering_spread = 0.2F; },
      [](Scene& s) { s.lights[0].shadow_density = glm::vec3(2.0F); },
      [](Scene& s) {
        s.lights[0].shadow_density = {1.0F, 2.0F, 3.0F};
      },
      [](Scene& s) { s.shadow.slices = 7; },
      [](Scene& s) { s.shadow.spacing = SliceSpacing::kEqualOpticalDepth; },
      [](Scene& s) {
        s.material.scattering_spread = 0.0F;
        s.material.physical_scattering = PhysicalScattering{0.8F, 0.9F};
      },
      [](Scene& s) { s.material.physical_scattering->albedo = 0.5F; },
      [](Scene& s) {
        s.material.physical_scattering.reset();
        s.shadow.blur_mode = BlurMode::kTexelsPerSlice;
        s.shadow.blur_texels = 1.0F;
      },
      [](Scene& s) { s.shadow.blur_texels = 2.0F; },
      [](Scene& s) { s.shadow.technique = GetParam() == kSweep ? kLayered : kSweep; },
  };
  Scene changed = scene;
  RenderBeauty(changed);
  for (const auto& change : changes) {
    change(changed);
    FrameRequest alone = test::Beauty(changed);
    alone.reuse = false;
    EXPECT_EQ(RenderBeauty(changed).pixels, Render(alone).images.at(0).pixels);
  }
}

TEST_P(ScatteringIn, OfAnyWidthAndAnyMediumKeepsLightBetweenNoneAndAll) {
  for (const float opacity : {0.01F, 0.3F, 0.999F}) {
    Scene scene = With(test::BallScene(300));
    scene.shadow.slices = 8;
    scene.material.opacity = opacity;
    const auto check = [&] {
      const Image buffer = Render({scene, {{ImageKind::kLightBuffer}}}).images.at(0);
      for (const float value : buffer.pixels) {
        ASSERT_GE(value, 0.0F);
        ASSERT_LE(value, 1.0F);
      }
      for (const float value : RenderBeauty(scene).pixels) ASSERT_TRUE(std::isfinite(value));
    };
    for (const float spread : {1e-4F, 1.0F, 100.0F, 1e30F}) {
      scene.material.scattering_spread = spread;
      check();
    }
    scene.material.scattering_spread = 0.0F;
    for (const float g : {0.0F, 0.5F, 0.99F}) {
      scene.material.physical_scattering = PhysicalScattering{g, 1.0F};
      check();
    }
  }
}

TEST_P(ScatteringIn, AFarPointLightIsThatOfADirectionalOne) {
  Scene scene = With(test::BallScene(4000));
  scene.lights = {test::Sun({0, 0, -1})};
  scene.material.physical_scattering = PhysicalScattering{0.8F, 0.9F};
  const Image directional = RenderBeauty(scene);
  scene.lights[0].kind = PointLight{{0.0, 0.0, 2000.0}, false};
  EXPECT_LT(RootMeanSquare(directional, RenderBeauty(scene)), 0.001);
}

TEST_P(ScatteringIn, NothingIsAnEmptyFrame) {
  Scene scene = With(test::BallScene(10));
  scene.particles = std::make_shared<ParticleSet>();
  scene.material.scattering_spread = 0.1F;
  const FrameResult frame =
      Render({scene, {{ImageKind::kBeauty}, {ImageKind::kLightBuffer}, {ImageKind::kLightLayers}}});
  for (const float value : frame.images[0].pixels) ASSERT_EQ(value, 0.0F);
  for (const float value : frame.images[1].pixels) ASSERT_EQ(value, 1.0F);
}

INSTANTIATE_TEST_SUITE_P(Techniques, ScatteringIn, testing::Values(kSweep, kLayered),
                         [](const auto& instance) {
                           return instance.param == kSweep ? "LightSweep" : "ParticleShadowMap";
                         });

}  // namespace
}  // namespace halflight
