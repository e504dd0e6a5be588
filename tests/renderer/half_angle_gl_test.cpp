// Frames of the plume against independent float64 evaluations: the image model without shadows, and
// half-angle slicing with an ideal light buffer.
#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "tests/oracle/image_error.h"
#include "tests/oracle/oracle.h"
#include "tests/oracle/plume.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

constexpr int kStride = 3;  // pixels of the oracle

Scene PlumeScene(const char* frame) {
  Scene scene;
  scene.particles =
      oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume." + frame + ".ply");
  scene.camera = test::LookAt({0.5, 1.5, 4.6}, {0, 1.25, 0}, 240, 240);
  scene.material.radius = 0.045F;
  scene.material.opacity = 0.18F;
  scene.shadow.slices = 64;
  scene.shadow.light_buffer_size = 1024;
  return scene;
}

class Plume : public test::GlTest {};

TEST_F(Plume, WithoutShadowsCoversWhatTheModelSays) {
  for (const char* frame : {"0024", "0040"}) {
    const Scene scene = PlumeScene(frame);
    ASSERT_NE(scene.particles, nullptr);
    const oracle::OracleImage reference = oracle::RenderUnshadowed(scene, {.stride = kStride});
    const double rmse = oracle::CompareCoverage(RenderBeauty(scene), reference).rmse;
    RecordProperty(std::string("coverage_rmse_") + frame, std::to_string(rmse));
    EXPECT_LT(rmse, 1e-4) << frame;
  }
}

struct ShadowCase {
  const char* name;
  glm::dvec3 light;
  bool interpolate = true;
  SliceSpacing spacing = SliceSpacing::kEqualCount;
  glm::vec3 density{1.0F};
  bool point = false;
  float phase_g = 0.0F;
  bool orthographic = false;
  Profile profile = Profile::kSoft;
  bool varied = false;  // radius, opacity, colour and emission of each particle its own
};

class PlumeLit : public test::GlTest, public testing::WithParamInterface<ShadowCase> {};

TEST_P(PlumeLit, IsHalfAngleSlicingWithinHalfAPercent) {
  const ShadowCase& c = GetParam();
  Scene scene = PlumeScene("0040");
  ASSERT_NE(scene.particles, nullptr);
  Light light = test::Sun(c.light);
  if (c.point) light.kind = PointLight{c.light};
  light.shadow_density = c.density;
  scene.lights = {light};
  scene.shadow.interpolate = c.interpolate;
  scene.shadow.spacing = c.spacing;
  scene.material.phase_g = c.phase_g;
  scene.material.profile = c.profile;
  if (c.varied) test::VaryParticles(scene, 0.05F, 0.4F);
  if (c.orthographic) scene.camera.projection = Orthographic{3.4};
  const oracle::OracleImage reference = oracle::RenderHalfAngle(scene, {.stride = kStride});
  scene.shadow.compositor = SliceCompositor::kRaster;
  const Image image = RenderBeauty(scene);
  const oracle::ImageError error = oracle::CompareColor(image, reference);
  RecordProperty("relative_rmse", std::to_string(error.relative_rmse));
  RecordProperty("bias", std::to_string(error.bias));
  std::cout << c.name << ": " << error.ToString() << "\n";
  EXPECT_LT(error.relative_rmse, 0.005);
  scene.shadow.compositor = SliceCompositor::kTiles;
  const double rounding = test::MaxDifference(RenderBeauty(scene), image);
  RecordProperty("tiles_against_raster", std::to_string(rounding));
  EXPECT_LT(rounding, 2e-5);
}

INSTANTIATE_TEST_SUITE_P(
    Lights, PlumeLit,
    testing::Values(
        ShadowCase{.name = "NearlyParallel", .light = {-0.2, -0.3, -1}},
        ShadowCase{.name = "Slanted", .light = {1, -0.6, -0.6}},
        ShadowCase{.name = "BeforeTheFlip", .light = {1, -0.2, -0.15}},
        ShadowCase{.name = "PastTheFlip", .light = {1, -0.2, 0.3}},
        ShadowCase{.name = "FromBehind", .light = {0.3, -0.4, 1}},
        ShadowCase{.name = "PlainSlanted", .light = {1, -0.6, -0.6}, .interpolate = false},
        ShadowCase{.name = "PlainFromBehind", .light = {0.3, -0.4, 1}, .interpolate = false},
        ShadowCase{.name = "VariedByCount", .light = {1, -0.6, -0.6}, .varied = true},
        ShadowCase{.name = "VariedByOpticalDepth",
                   .light = {1, -0.6, -0.6},
                   .spacing = SliceSpacing::kEqualOpticalDepth,
                   .varied = true},
        ShadowCase{.name = "Coloured", .light = {1, -0.6, -0.6}, .density = {0.3F, 1, 2}},
        ShadowCase{.name = "PointLight", .light = {2, 3, 1.5}, .point = true},
        ShadowCase{.name = "ForwardScattering", .light = {0.3, -0.4, 1}, .phase_g = 0.6F},
        ShadowCase{.name = "Orthographic", .light = {1, -0.6, -0.6}, .orthographic = true},
        ShadowCase{.name = "Balls", .light = {1, -0.6, -0.6}, .profile = Profile::kBall}),
    [](const auto& param) { return param.param.name; });

}  // namespace
}  // namespace halflight
