// Conversion of valid requests: defaults, units, matrices, and the way back to the frame's header.
// What is refused stands in validation_test.

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include "server/convert/convert_frame.h"
#include "server/convert/convert_shadow.h"
#include "server/convert/describe.h"
#include "server/convert/geometry.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using testing::FakeImage;
using testing::MakeParticles;
using testing::MakeRequest;
using testing::MustConvert;

// Where a world point lands in the image, (0, 0) top left to (1, 1) bottom right.
glm::dvec3 Project(const glm::dmat4& matrix, const glm::dvec3& point) {
  const glm::dvec4 p = matrix * glm::dvec4(point, 1.0);
  return glm::dvec3(p) / p.w;
}

TEST(ConvertRequest, FillsInTheDefaultsOfTheManual) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_camera()->clear_width();
  request.mutable_scene()->mutable_camera()->clear_height();
  const Scene scene = MustConvert(request).request.scene;
  EXPECT_EQ(scene.camera.width, 640);
  EXPECT_EQ(scene.camera.height, 480);
  EXPECT_EQ(scene.camera.window.width, 640);
  EXPECT_NEAR(std::get<Perspective>(scene.camera.projection).vertical_fov,
              40.0 * std::numbers::pi / 180.0, 1e-15);
  EXPECT_EQ(scene.material.opacity, 0.18F);
  EXPECT_EQ(scene.material.ambient, glm::vec3(0.1F));
  EXPECT_EQ(scene.shadow.slices, 128);
  EXPECT_TRUE(scene.shadow.interpolate);
  EXPECT_EQ(scene.shadow.light_buffer_size, 0);  // left to the plan
  EXPECT_EQ(scene.shadow.max_light_buffer_size, 4096);
  EXPECT_EQ(scene.lights[0].color, glm::vec3(1.0F));
  EXPECT_EQ(scene.lights[0].shadow_density, glm::vec3(1.0F));
  EXPECT_EQ(scene.sampling.supersample, 1);
}

TEST(ConvertRequest, ReadsEveryAttributeOfTheParticlesFromItsPlace) {
  v1::RenderFrameRequest request = MakeRequest();
  // Listed backwards: the payload's order does not follow the list.
  *request.mutable_scene()->mutable_inline_particles() =
      MakeParticles(3, {v1::PARTICLE_ATTRIBUTE_EMISSION, v1::PARTICLE_ATTRIBUTE_VELOCITY,
                        v1::PARTICLE_ATTRIBUTE_COLOR, v1::PARTICLE_ATTRIBUTE_OPACITY,
                        v1::PARTICLE_ATTRIBUTE_RADIUS, v1::PARTICLE_ATTRIBUTE_POSITION});
  request.mutable_scene()->mutable_inline_particles()->mutable_layout()->mutable_origin()->set_x(
      1e7);
  const auto set = MustConvert(request).request.scene.particles;
  ASSERT_NE(set, nullptr);
  ASSERT_EQ(set->size(), 3U);
  EXPECT_EQ(set->origin, glm::dvec3(1e7, 0.0, 0.0));
  EXPECT_EQ(set->positions[1], glm::vec3(1.0F / 4, 1.0F / 5, 1.0F / 6));
  EXPECT_EQ(set->radii, (std::vector<float>{1.0F, 1.0F / 2, 1.0F / 3}));
  EXPECT_EQ(set->opacities.size(), 3U);
  EXPECT_EQ(set->colors[2].z, 1.0F / 9);
  EXPECT_EQ(set->velocities.size(), 3U);
  EXPECT_EQ(set->emissions[0].x, 1.0F);
}

TEST(ConvertRequest, DensityOfZeroCastsNoShadows) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_lighting()->mutable_lights(0)->set_density(0.0F);
  EXPECT_FALSE(MustConvert(request).request.scene.lights[0].casts_shadows());
}

TEST(ConvertRequest, LightDirectionOfAnyLengthBecomesAUnitVector) {
  for (const double length : {1e-300, 1e-3, 1.0, 1e300}) {
    v1::RenderFrameRequest request = MakeRequest();
    auto& direction = *request.mutable_scene()
                           ->mutable_lighting()
                           ->mutable_lights(0)
                           ->mutable_directional()
                           ->mutable_direction();
    direction.set_x(3.0 * length);
    direction.set_y(-4.0 * length);
    const Scene scene = MustConvert(request).request.scene;
    const glm::dvec3 unit = std::get<DirectionalLight>(scene.lights[0].kind).direction;
    EXPECT_NEAR(unit.x, 0.6, 1e-15) << length;
    EXPECT_NEAR(unit.y, -0.8, 1e-15) << length;
  }
}

TEST(ConvertRequest, EmptySetIsAValidFrame) {
  v1::RenderFrameRequest request = MakeRequest();
  *request.mutable_scene()->mutable_inline_particles() =
      MakeParticles(0, {v1::PARTICLE_ATTRIBUTE_POSITION});
  EXPECT_EQ(MustConvert(request).request.scene.particles->size(), 0U);
}

TEST(ConvertRequest, OutputsThatShowTheSameShareOneImage) {
  v1::RenderFrameRequest request = MakeRequest();
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_DEPTH);
  auto& again = *request.add_outputs();
  again.set_kind(v1::OUTPUT_KIND_BEAUTY);
  again.set_format(v1::IMAGE_FORMAT_EXR_FLOAT);
  again.set_compression(v1::EXR_COMPRESSION_PIZ);
  const FrameJob job = MustConvert(request);
  ASSERT_EQ(job.outputs.size(), 3U);
  EXPECT_EQ(job.request.images.size(), 2U);
  EXPECT_EQ(job.outputs[2].image, job.outputs[0].image);
  EXPECT_EQ(job.outputs[0].encoding.format, ImageFormat::kPng8);
  EXPECT_EQ(job.outputs[1].encoding.format, ImageFormat::kExrFloat);
  EXPECT_EQ(job.outputs[2].encoding.compression, ExrCompression::kPiz);
}

TEST(ConvertRequest, CropLetsAWindowBeSupersampledThatTheWholeImageCouldNot) {
  ServerLimits limits;
  limits.max_image_size = 100;
  v1::RenderFrameRequest request = MakeRequest();
  v1::Camera& camera = *request.mutable_scene()->mutable_camera();
  camera.set_width(100);
  camera.set_height(100);
  camera.mutable_crop()->set_x(75);
  camera.mutable_crop()->set_width(25);
  camera.mutable_crop()->set_height(25);
  request.mutable_scene()->mutable_sampling()->set_supersample(4);
  const PixelRect window = MustConvert(request, limits).request.scene.camera.window;
  EXPECT_EQ(window.x, 75);
  EXPECT_EQ(window.width, 25);
}

TEST(ConvertCamera, LookAtPutsTheTargetAheadAndUpUpward) {
  const v1::RenderFrameRequest request = MakeRequest();
  const glm::dmat4 view = MustConvert(request).request.scene.camera.view_from_world;
  EXPECT_EQ(Project(view, {0, 0, 0}), glm::dvec3(0, 0, -10));
  EXPECT_EQ(Project(view, {1, 2, 0}), glm::dvec3(1, 2, -10));
}

TEST(ConvertCamera, UpParallelToTheViewStillGivesARotation) {
  for (const double sign : {1.0, -1.0}) {
    v1::RenderFrameRequest request = MakeRequest();
    v1::LookAt& look_at = *request.mutable_scene()->mutable_camera()->mutable_look_at();
    look_at.mutable_eye()->set_z(0.0);
    look_at.mutable_eye()->set_y(5.0 * sign);
    const glm::dmat4 view = MustConvert(request).request.scene.camera.view_from_world;
    EXPECT_TRUE(IsRigid(view));
    EXPECT_NEAR(Project(view, {0, 0, 0}).z, -5.0, 1e-12);
  }
}

TEST(ConvertCamera, MatrixIsReadRowByRow) {
  v1::RenderFrameRequest request = MakeRequest();
  auto& matrix = *request.mutable_scene()->mutable_camera()->mutable_world_to_camera();
  // A quarter turn about z, then a move by (7, 8, 9).
  for (const double e : {0., -1., 0., 7., 1., 0., 0., 8., 0., 0., 1., 9., 0., 0., 0., 1.}) {
    matrix.add_elements(e);
  }
  const glm::dmat4 view = MustConvert(request).request.scene.camera.view_from_world;
  EXPECT_EQ(Project(view, {1, 0, 0}), glm::dvec3(7, 9, 9));
}

TEST(NdcFromWorld, CornersOfTheFrustumAreTheCornersOfTheImage) {
  Camera camera;
  camera.width = 200;
  camera.height = 100;
  camera.projection = Perspective{std::numbers::pi / 2};
  // At distance 3 the image is 6 high and 12 wide.
  EXPECT_NEAR(Project(NdcFromWorld(camera), {-6, 3, -3}).x, 0.0, 1e-12);
  EXPECT_NEAR(Project(NdcFromWorld(camera), {-6, 3, -3}).y, 0.0, 1e-12);
  EXPECT_NEAR(Project(NdcFromWorld(camera), {6, -3, -3}).x, 1.0, 1e-12);
  EXPECT_NEAR(Project(NdcFromWorld(camera), {6, -3, -3}).y, 1.0, 1e-12);

  camera.projection = Orthographic{10.0};
  EXPECT_NEAR(Project(NdcFromWorld(camera), {-10, 5, -3}).x, 0.0, 1e-12);
  EXPECT_NEAR(Project(NdcFromWorld(camera), {-10, 5, -3}).y, 0.0, 1e-12);
  EXPECT_NEAR(Project(NdcFromWorld(camera), {0, 0, -99}).y, 0.5, 1e-12);
}

TEST(Bounds, HoldEveryParticleWithItsRadiusWhereItHasMovedTo) {
  ParticleSet set;
  set.origin = {100, 0, 0};
  set.positions = {{-1, 0, 0}, {1, 0, 0}};
  EXPECT_DOUBLE_EQ(Bounds(set, 0.5F, 0.0)->radius, 1.5);
  EXPECT_EQ(Bounds(set, 0.5F, 0.0)->center, glm::dvec3(100, 0, 0));
  set.velocities = {{-1, 0, 0}, {1, 0, 0}};
  EXPECT_DOUBLE_EQ(Bounds(set, 0.5F, 2.0)->radius, 3.5);
  EXPECT_FALSE(Bounds(ParticleSet{}, 0.5F, 0.0).has_value());
}

ShadowTechniqueKind TechniqueOf(const v1::RenderFrameRequest& request, bool software) {
  ParticleStore store(1 << 20);
  const auto job = ConvertRequest(request, store, {},
                                  {.gl_renderer = "fake", .gl_version = {}, .software = software});
  EXPECT_TRUE(job.ok()) << job.status();
  return job.ok() ? job->request.scene.shadow.technique : ShadowTechniqueKind::kReference;
}

TEST(ConvertTechnique, IsTheSweepOnACpuWhereTheRequestLeavesItOpen) {
  v1::RenderFrameRequest request = MakeRequest();
  EXPECT_EQ(TechniqueOf(request, true), ShadowTechniqueKind::kLightSweep);
  EXPECT_EQ(TechniqueOf(request, false), ShadowTechniqueKind::kHalfAngle);
  request.mutable_scene()->mutable_shadow()->set_fit_degree(2);
  request.mutable_scene()->mutable_shadow()->set_light_buffer_size(128);
  EXPECT_EQ(TechniqueOf(request, true), ShadowTechniqueKind::kLightSweep);
  request.mutable_scene()->mutable_shadow()->set_technique(v1::SHADOW_TECHNIQUE_HALF_ANGLE);
  EXPECT_EQ(TechniqueOf(request, true), ShadowTechniqueKind::kHalfAngle);
}

TEST(ConvertCompositor, IsByTheDeviceWhereTheRequestLeavesItOpen) {
  v1::RenderFrameRequest request = MakeRequest();
  const auto compositor_of = [&](bool software) {
    ParticleStore store(1 << 20);
    const auto job = ConvertRequest(
        request, store, {}, {.gl_renderer = "fake", .gl_version = {}, .software = software});
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? DescribeShadow(job->request.scene.shadow).compositor()
                    : v1::SLICE_COMPOSITOR_UNSPECIFIED;
  };
  EXPECT_EQ(compositor_of(true), v1::SLICE_COMPOSITOR_RASTER);
  EXPECT_EQ(compositor_of(false), v1::SLICE_COMPOSITOR_TILES);
  for (const auto asked : {v1::SLICE_COMPOSITOR_RASTER, v1::SLICE_COMPOSITOR_TILES}) {
    request.mutable_scene()->mutable_shadow()->set_compositor(asked);
    EXPECT_EQ(compositor_of(true), asked);
    EXPECT_EQ(compositor_of(false), asked);
  }
}

// Scattering and layers the sweep has itself.
TEST(ConvertTechnique, IsTheSweepOnACpuWhereLightScattersOrShowsItsLayers) {
  using Change = void (*)(v1::RenderFrameRequest&);
  const Change changes[] = {
      [](v1::RenderFrameRequest& r) {
        r.mutable_scene()->mutable_material()->set_scattering_spread(0.1F);
      },
      [](v1::RenderFrameRequest& r) {
        r.mutable_scene()->mutable_material()->mutable_physical_scattering();
      },
      [](v1::RenderFrameRequest& r) { r.add_outputs()->set_kind(v1::OUTPUT_KIND_LIGHT_LAYERS); },
  };
  for (const Change& change : changes) {
    v1::RenderFrameRequest request = MakeRequest();
    change(request);
    EXPECT_EQ(TechniqueOf(request, true), ShadowTechniqueKind::kLightSweep)
        << request.ShortDebugString();
    EXPECT_EQ(TechniqueOf(request, false), ShadowTechniqueKind::kHalfAngle)
        << request.ShortDebugString();
  }
}

// Whatever is set of slices asks for them.
TEST(ConvertTechnique, IsSlicesWhereTheRequestNeedsThem) {
  using Change = void (*)(v1::RenderFrameRequest&);
  const Change changes[] = {
      [](v1::RenderFrameRequest& r) { r.mutable_scene()->mutable_shadow()->set_slices(64); },
      [](v1::RenderFrameRequest& r) { r.mutable_scene()->mutable_shadow()->set_interpolate(true); },
      [](v1::RenderFrameRequest& r) {
        r.mutable_scene()->mutable_shadow()->set_spacing(v1::SLICE_SPACING_EQUAL_COUNT);
      },
      [](v1::RenderFrameRequest& r) {
        r.mutable_scene()->mutable_shadow()->set_compositor(v1::SLICE_COMPOSITOR_RASTER);
      },
      [](v1::RenderFrameRequest& r) {
        r.mutable_scene()->mutable_shadow()->set_blur_mode(v1::BLUR_MODE_DISTANCE);
      },
  };
  for (const Change& change : changes) {
    v1::RenderFrameRequest request = MakeRequest();
    change(request);
    EXPECT_EQ(TechniqueOf(request, true), ShadowTechniqueKind::kHalfAngle)
        << request.ShortDebugString();
  }
}

TEST(ConvertFrame, LetsASearchReuseNothing) {
  v1::RenderFrameRequest request = MakeRequest();
  EXPECT_TRUE(MustConvert(request).request.reuse);
  request.mutable_target()->set_max_error(0.1);
  EXPECT_FALSE(MustConvert(request).request.reuse);
}

TEST(DescribeFrame, TellsSettingsAsUsedAndTheMatricesOfTheWholeImage) {
  v1::RenderFrameRequest request = MakeRequest();
  request.set_request_id("shot 7");
  v1::CropWindow& crop = *request.mutable_scene()->mutable_camera()->mutable_crop();
  crop.set_width(8);
  crop.set_height(4);
  const FrameJob job = MustConvert(request);
  MadeFrame frame;
  frame.rendered.images = {FakeImage(job.request.scene, job.request.images[0], 0)};
  frame.rendered.lights.resize(1);
  frame.rendered.clamped_opacities = 3;
  frame.rendered.timings = {{"encode", 2.5}};
  const DeviceInfo device{.gl_renderer = "fake", .gl_version = "4.5"};
  const v1::FrameHeader header = DescribeFrame(
      job, frame, {{.bytes = SharedBytes("abc"), .media_type = "image/png", .white_black = {}}},
      device, "1.2.3");

  EXPECT_EQ(header.metadata().request_id(), "shot 7");
  EXPECT_EQ(header.metadata().shadow().slices(), 128U);
  EXPECT_EQ(header.metadata().shadow().technique(), v1::SHADOW_TECHNIQUE_HALF_ANGLE);
  EXPECT_EQ(header.metadata().particle_count(), 2U);
  EXPECT_EQ(header.metadata().clamped_opacities(), 3U);
  EXPECT_EQ(header.metadata().particle_sha256(), job.particle_sha256);
  EXPECT_EQ(header.metadata().world_to_camera().elements(11), -10.0);  // last of the third row
  EXPECT_EQ(header.outputs(0).output().format(), v1::IMAGE_FORMAT_PNG8);
  EXPECT_EQ(header.outputs(0).width(), 8U);
  EXPECT_EQ(header.outputs(0).byte_size(), 3U);
  EXPECT_FALSE(header.outputs(0).has_white_value());

  const ImageMetadata metadata = DescribeImage(job, frame, job.outputs[0], device, "1.2.3");
  EXPECT_EQ(metadata.data_window.width, 8);
  EXPECT_EQ(metadata.display_size, glm::ivec2(64, 48));
  EXPECT_EQ(*metadata.world_to_ndc, NdcFromWorld(job.request.scene.camera));
}

TEST(DescribeImage, LightBuffersCarryTheMatricesOfTheirLight) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_LIGHT_BUFFER);
  const FrameJob job = MustConvert(request);
  MadeFrame frame;
  LightReport& light = frame.rendered.lights.emplace_back();
  light.light_texture_from_world[3][0] = 5.0;
  light.light_view_from_world[3][0] = 6.0;
  const ImageMetadata metadata = DescribeImage(job, frame, job.outputs[0], DeviceInfo{}, "1");
  EXPECT_EQ(*metadata.world_to_ndc, light.light_texture_from_world);
  EXPECT_EQ(*metadata.world_to_camera, light.light_view_from_world);
  EXPECT_EQ(metadata.display_size, glm::ivec2(0));
}

}  // namespace
}  // namespace halflight
