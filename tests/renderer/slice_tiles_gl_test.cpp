// Slices by tiles in compute against the same slices through the blend units: the order is the
// same, and so is what a particle adds; what remains is the rounding of sums.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

// Sums of a few hundred layers in float32, added one by one or in runs.
constexpr double kRounding = 2e-5;

struct SliceCase {
  const char* name;
  void (*change)(Scene&);
};

Light WithDensity(Light light, const glm::vec3& density) {
  light.shadow_density = density;
  return light;
}

// Every output, of a front and a back light unless the case says otherwise.
FrameRequest Request(const SliceCase& c) {
  FrameRequest request{test::BallScene(3000, 150), {}};
  Scene& scene = request.scene;
  scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  scene.camera.height = scene.camera.window.height = 131;
  scene.lights = {test::Sun({1, -1, -0.5})};
  c.change(scene);
  request.images = {{ImageKind::kBeauty}, {ImageKind::kCoverage}, {ImageKind::kDepth}};
  for (int light = 0; light < static_cast<int>(scene.lights.size()); ++light) {
    if (!scene.lights[static_cast<size_t>(light)].casts_shadows()) continue;
    request.images.push_back({ImageKind::kLightTransmittance, light});
    request.images.push_back({ImageKind::kLightBuffer, light, LightQuantity::kOpticalDepth});
    request.images.push_back({ImageKind::kLightLayers, light});
  }
  return request;
}

class SlicesInTiles : public test::GlTest {
 protected:
  static FrameResult RenderBy(SliceCompositor compositor, FrameRequest request) {
    request.scene.shadow.compositor = compositor;
    return Render(request);
  }
};

class SlicesInTilesOf : public SlicesInTiles, public testing::WithParamInterface<SliceCase> {};

TEST_P(SlicesInTilesOf, AreWhatBlendingDraws) {
  const FrameRequest request = Request(GetParam());
  const FrameResult raster = RenderBy(SliceCompositor::kRaster, request);
  const FrameResult tiles = RenderBy(SliceCompositor::kTiles, request);
  ASSERT_EQ(tiles.images.size(), raster.images.size());
  for (size_t i = 0; i < raster.images.size(); ++i) {
    const Image& expected = raster.images[i];
    const Image& image = tiles.images[i];
    ASSERT_EQ(image.pixels.size(), expected.pixels.size()) << "output " << i;
    double largest = 0.0;
    for (size_t k = 0; k < image.pixels.size(); ++k) {
      // Depth is infinite where nothing is; elsewhere all values are of the order of 1.
      if (image.pixels[k] == expected.pixels[k]) continue;
      const double scale = std::max(1.0, std::abs(static_cast<double>(expected.pixels[k])));
      largest = std::max(largest, std::abs(image.pixels[k] - expected.pixels[k]) / scale);
    }
    EXPECT_LT(largest, kRounding) << "output " << i;
  }
  EXPECT_GT(test::PixelAt(tiles.images[0], 75, 65)[3], 0.3F);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, SlicesInTilesOf,
    testing::Values(
        SliceCase{"FrontToBack", [](Scene&) {}},
        SliceCase{"BackToFront",
                  [](Scene& s) {
                    s.lights = {test::Sun({0.3, -0.4, 1})};
                  }},
        SliceCase{"Plain", [](Scene& s) { s.shadow.interpolate = false; }},
        SliceCase{"PlainBackToFront",
                  [](Scene& s) {
                    s.shadow.interpolate = false;
                    s.lights = {test::Sun({0.3, -0.4, 1})};
                  }},
        SliceCase{"ColouredDensity",
                  [](Scene& s) {
                    s.lights = {WithDensity(test::Sun({1, -0.6, -0.6}), {0.3F, 1.0F, 2.0F})};
                  }},
        SliceCase{"PointLight",
                  [](Scene& s) {
                    s.lights.front().kind = PointLight{{2, 3, 1.5}, true};
                  }},
        SliceCase{"PhaseFunction", [](Scene& s) { s.material.phase_g = 0.6F; }},
        SliceCase{"Orthographic", [](Scene& s) { s.camera.projection = Orthographic{2.6}; }},
        SliceCase{"Balls", [](Scene& s) { s.material.profile = Profile::kBall; }},
        SliceCase{"VariedByOpticalDepth",
                  [](Scene& s) {
                    test::VaryParticles(s, 0.05F, 0.4F);
                    s.shadow.spacing = SliceSpacing::kEqualOpticalDepth;
                  }},
        SliceCase{"FromWithin",
                  [](Scene& s) {
                    const Camera whole = s.camera;
                    s.camera = test::LookAt({0.1, 0.2, 0.3}, {0, 0, -1}, whole.width, whole.height);
                  }},
        SliceCase{"SeveralLights",
                  [](Scene& s) {
                    s.lights = {test::Sun({1, -1, -0.5}), test::Sun({0.3, -0.4, 1}),
                                test::Sun({0, -1, 0}, 0.0F)};
                    s.lights.back().kind = PointLight{{0, 3, 0}, true};
                  }},
        SliceCase{"Unshadowed",
                  [](Scene& s) { s.lights.front().shadow_density = glm::vec3(0.0F); }},
        SliceCase{"OneSlice", [](Scene& s) { s.shadow.slices = 1; }},
        SliceCase{"OneParticleASlice", [](Scene& s) { s.shadow.slices = 3000; }},
        SliceCase{"Blurred", [](Scene& s) { s.material.scattering_spread = 0.2F; }},
        SliceCase{"BlurredPlain",
                  [](Scene& s) {
                    s.material.scattering_spread = 0.2F;
                    s.shadow.interpolate = false;
                  }},
        SliceCase{"BlurredInColour",
                  [](Scene& s) {
                    s.material.scattering_spread = 0.2F;
                    s.lights = {WithDensity(test::Sun({0.3, -0.4, 1}), {0.3F, 1.0F, 2.0F})};
                  }},
        SliceCase{"PhysicallyScattered",
                  [](Scene& s) {
                    s.material.physical_scattering = PhysicalScattering{0.7F, 0.9F};
                  }},
        SliceCase{"PhysicallyScatteredInColour",
                  [](Scene& s) {
                    s.material.physical_scattering = PhysicalScattering{0.7F, 0.9F};
                    s.lights = {WithDensity(test::Sun({1, -0.6, -0.6}), {0.3F, 1.0F, 2.0F})};
                  }},
        SliceCase{"Supersampled", [](Scene& s) { s.sampling.supersample = 2; }}),
    [](const auto& instance) { return instance.param.name; });

// Of nine coloured light buffers of 16 MiB, two a slice where interpolated, one run's layers hold
// no more than eight. Runs without blur: PlumeLit.
TEST_F(SlicesInTiles, GoInRunsOfAsManySlicesAsLayersHold) {
  for (const bool interpolate : {false, true}) {
    FrameRequest request = test::Beauty(test::BallScene(100, 32));
    Scene& scene = request.scene;
    scene.lights = {WithDensity(test::Sun({1, -1, interpolate ? 1 : -0.5}), {0.5F, 1.0F, 2.0F})};
    scene.shadow.slices = 9;
    scene.shadow.interpolate = interpolate;
    scene.shadow.light_buffer_size = 1024;
    scene.shadow.blur_mode = BlurMode::kTexelsPerSlice;
    scene.shadow.blur_texels = 0.5F;
    const Image raster = RenderBy(SliceCompositor::kRaster, request).images.at(0);
    const Image tiles = RenderBy(SliceCompositor::kTiles, request).images.at(0);
    EXPECT_LT(test::MaxDifference(tiles, raster), kRounding) << "interpolated " << interpolate;
  }
}

// More of them in one tile than one dispatch may loop over on a CPU, of the image and of the light
// buffer; each adds less than float32 keeps of a sum near 1.
TEST_F(SlicesInTiles, AddThinLayersUp) {
  constexpr int kCount = 150'000;
  constexpr float kOpacity = 1e-5F;
  Scene scene = test::BallScene(0, 16);
  auto set = std::make_shared<ParticleSet>();
  for (int i = 0; i < kCount; ++i) {
    set->positions.emplace_back(0.0F, 0.0F, static_cast<float>(i) * 1e-6F);
  }
  scene.particles = set;
  scene.camera.projection = Orthographic{2.0};
  scene.material.radius = 1.0F;
  scene.material.opacity = kOpacity;
  scene.shadow.light_buffer_size = 16;
  for (const double along_view : {-1.0, 1.0}) {
    scene.lights = {test::Sun({0, 0, along_view})};
    FrameRequest request = test::Beauty(scene);
    request.images.push_back({ImageKind::kLightBuffer, 0, LightQuantity::kOpticalDepth});
    const FrameResult frame = RenderBy(SliceCompositor::kTiles, request);
    // The middle of the pixel, in radii.
    const double rho_squared = 2.0 * (0.5 / 8.0) * (0.5 / 8.0);
    const double optical_depth = -std::log1p(-static_cast<double>(kOpacity)) * kCount;
    EXPECT_NEAR(test::PixelAt(frame.images[0], 8, 8)[3],
                1.0 - std::exp(-optical_depth * (1.0 - rho_squared)), 5e-6)
        << along_view;
    const Image& light = frame.images[1];
    EXPECT_GT(*std::max_element(light.pixels.begin(), light.pixels.end()), 0.95 * optical_depth)
        << along_view;
  }
}

TEST_F(SlicesInTiles, AreDrawnWhereTheRequestAsksOrTheDeviceIsAGpu) {
  FrameRequest request = test::Beauty(test::BallScene(100, 16));
  const auto in_tiles = [&](SliceCompositor compositor) {
    const FrameResult frame = RenderBy(compositor, request);
    return frame.plan.traversals.at(0).in_tiles;
  };
  EXPECT_FALSE(in_tiles(SliceCompositor::kRaster));
  EXPECT_TRUE(in_tiles(SliceCompositor::kTiles));
  EXPECT_EQ(in_tiles(SliceCompositor::kAuto), !Renderer().device().software);
}

TEST_F(SlicesInTiles, OfNothingShowNothing) {
  FrameRequest request = test::Beauty(test::BallScene(0, 16));
  request.images.push_back({ImageKind::kLightLayers, 0});
  const FrameResult frame = RenderBy(SliceCompositor::kTiles, request);
  for (const float value : frame.images.at(0).pixels) EXPECT_EQ(value, 0.0F);
}

}  // namespace
}  // namespace halflight
