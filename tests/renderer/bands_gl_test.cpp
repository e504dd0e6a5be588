// Frames larger than a render target may be: band by band the same bits as drawn at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using ::testing::HasSubstr;

constexpr int kMaxSide = 64;

class Bands : public test::GlTest {
 protected:
  static FrameRenderer& SmallRenderer() {
    static const std::unique_ptr<FrameRenderer> renderer =
        *FrameRenderer::Create("auto", {.max_texture_size = kMaxSide});
    return *renderer;
  }
};

// Two lights that cast shadows, one of them coloured, and every output; the window is a part of the
// image, at odd places.
FrameRequest Request() {
  FrameRequest request{test::BallScene(600), {}};
  Scene& scene = request.scene;
  scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  scene.camera.width = 170;
  scene.camera.height = 150;
  scene.camera.window = {7, 9, 150, 131};
  scene.shadow.light_buffer_size = 64;
  scene.shadow.slices = 8;
  scene.lights.push_back(test::Sun({-1, -0.3, 1}));
  scene.lights.back().shadow_density = {0.5F, 1.0F, 2.0F};
  request.images = {{ImageKind::kBeauty},
                    {ImageKind::kCoverage},
                    {ImageKind::kDepth},
                    {ImageKind::kLightTransmittance, 0},
                    {ImageKind::kLightTransmittance, 1},
                    {ImageKind::kLightBuffer, 1, LightQuantity::kOpticalDepth},
                    {ImageKind::kLightLayers, 0}};
  return request;
}

struct BandCase {
  const char* name;
  void (*change)(Scene&);
};

class BandsOf : public Bands, public testing::WithParamInterface<BandCase> {};

void ExpectSameInBands(const FrameRequest& request, FrameRenderer& at_once,
                       FrameRenderer& in_bands) {
  const absl::StatusOr<FrameResult> drawn = at_once.Render(request, {});
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  const FrameResult& whole = *drawn;
  const absl::StatusOr<FrameResult> bands = in_bands.Render(request, {});
  ASSERT_TRUE(bands.ok()) << bands.status();
  ASSERT_EQ(bands->images.size(), whole.images.size());
  for (size_t i = 0; i < whole.images.size(); ++i) {
    EXPECT_EQ(bands->images[i].width, whole.images[i].width) << i;
    EXPECT_TRUE(bands->images[i].pixels == whole.images[i].pixels)
        << "output " << i << ", off by " << test::MaxDifference(bands->images[i], whole.images[i]);
  }
}

TEST_P(BandsOf, ShowWhatIsDrawnAtOnce) {
  FrameRequest request = Request();
  GetParam().change(request.scene);
  ExpectSameInBands(request, Renderer(), SmallRenderer());
}

// With tiles that reach over the borders between bands.
TEST_P(BandsOf, ShowWhatTheSweepDrawsAtOnceOnTheDevice) {
  FrameRequest request = Request();
  GetParam().change(request.scene);
  request.scene.shadow.technique = ShadowTechniqueKind::kLightSweep;
  request.scene.shadow.fit_degree = 1;
  request.sweep_on = SweepOn::kDevice;
  request.images = {{ImageKind::kBeauty},
                    {ImageKind::kDepth},
                    {ImageKind::kLightTransmittance, 1},
                    {ImageKind::kLightBuffer, 1, LightQuantity::kOpticalDepth}};
  if (!request.scene.lights[1].casts_shadows()) request.images.resize(2);
  ExpectSameInBands(request, Renderer(), SmallRenderer());
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, BandsOf,
    testing::Values(BandCase{"OneSampleAPixel", [](Scene&) {}},
                    BandCase{"Supersampled", [](Scene& s) { s.sampling.supersample = 3; }},
                    BandCase{"Downsampled", [](Scene& s) { s.sampling.downsample = 2; }},
                    BandCase{"DownsampledOddly", [](Scene& s) { s.sampling.downsample = 5; }},
                    BandCase{"ParallelRays",
                             [](Scene& s) { s.camera.projection = Orthographic{2.6}; }},
                    BandCase{"Unshadowed",
                             [](Scene& s) {
                               for (Light& light : s.lights) light.shadow_density = glm::vec3(0.0F);
                             }},
                    BandCase{"FromWithin",
                             [](Scene& s) {
                               const PixelRect window = s.camera.window;
                               s.camera = test::LookAt({0.1, 0.2, 0.3}, {0, 0, -1}, 170, 150);
                               s.camera.window = window;
                             }}),
    [](const auto& instance) { return instance.param.name; });

// Tiles begin with their band, and sums are cut where tiles' lists are.
TEST_F(Bands, OfTilesShowWhatIsDrawnAtOnceButForRounding) {
  FrameRequest request = Request();
  request.scene.sampling.supersample = 3;
  request.scene.shadow.compositor = SliceCompositor::kTiles;
  const FrameResult whole = Render(request);
  absl::StatusOr<FrameResult> bands = SmallRenderer().Render(request, {});
  ASSERT_TRUE(bands.ok()) << bands.status();
  for (const size_t i : {0, 1, 3, 4, 5, 6}) {  // depth is infinite in places
    EXPECT_LT(test::MaxDifference(bands->images[i], whole.images[i]), 5e-6) << "output " << i;
  }
}

TEST_F(Bands, LightBuffersStayWithinTheDevice) {
  FrameRequest request = Request();
  request.scene.shadow.light_buffer_size = kMaxSide + 1;
  const auto frame = SmallRenderer().Render(request, {});
  EXPECT_TRUE(absl::IsInvalidArgument(frame.status())) << frame.status();
  EXPECT_THAT(frame.status().message(), HasSubstr("shadow.light_buffer_size: 65, allowed on "));
}

// The device's own limit, not an injected one: across the seam as a window shows it.
TEST_F(Bands, ReachBeyondTheDevicesOwnLimit) {
  const int limit = Renderer().device().max_texture_size;
  FrameRequest request = test::Beauty(test::BallScene(200));
  Camera& camera = request.scene.camera;
  camera.width = limit + 40;
  camera.height = 6;
  camera.window = {0, 0, camera.width, camera.height};
  camera.projection = Orthographic{6.0 * 2.0 / camera.width};
  request.scene.material.radius = 0.5F;
  request.scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  const Image whole = Render(request).images.at(0);
  ASSERT_EQ(whole.width, limit + 40);
  camera.window = {limit - 20, 0, 40, 6};
  const Image seam = Render(request).images.at(0);
  EXPECT_GT(test::PixelAt(seam, 20, 3)[3], 0.1F);
  for (int x = 0; x < 40; ++x) {
    for (int c = 0; c < 4; ++c) {
      EXPECT_NEAR(test::PixelAt(seam, x, 3)[c], test::PixelAt(whole, limit - 20 + x, 3)[c], 1e-4);
    }
  }
}

}  // namespace
}  // namespace halflight
