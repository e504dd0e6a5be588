// Every request that is refused, and what it is told: path of the field, value, what is allowed.

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/convert/convert_frame.h"
#include "server/error_detail.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using testing::MakeParticles;
using testing::MakeRequest;
using ::testing::StartsWith;
using Request = v1::RenderFrameRequest;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

struct Refusal {
  const char* name;
  std::function<void(Request&)> change;
  std::string message;  // how it starts
};

v1::Camera& CameraOf(Request& request) { return *request.mutable_scene()->mutable_camera(); }
v1::Light& LightOf(Request& request) {
  return *request.mutable_scene()->mutable_lighting()->mutable_lights(0);
}
v1::Material& MaterialOf(Request& request) { return *request.mutable_scene()->mutable_material(); }
v1::Shadow& ShadowOf(Request& request) { return *request.mutable_scene()->mutable_shadow(); }
v1::Output& OutputOf(Request& request) { return *request.mutable_outputs(0); }
v1::InlineParticles& ParticlesOf(Request& request) {
  return *request.mutable_scene()->mutable_inline_particles();
}

// A point light with shadows at (x, 0, 0); the particles of MakeRequest fit a sphere of radius 2.
void UsePointLight(Request& request, double x) {
  LightOf(request).mutable_point()->mutable_position()->set_x(x);
}

void UseMatrix(Request& request, const std::vector<double>& elements) {
  auto& matrix = *CameraOf(request).mutable_world_to_camera();
  matrix.clear_elements();
  for (const double element : elements) {
    matrix.add_elements(element);
  }
}

void UseParticles(Request& request, const std::vector<v1::ParticleAttribute>& attributes) {
  ParticlesOf(request) = MakeParticles(2, attributes);
}

// Overwrites one float of the payload.
void Poke(Request& request, size_t index, double value) {
  const auto narrowed = static_cast<float>(value);
  std::memcpy(ParticlesOf(request).mutable_payload()->data() + index * sizeof(float), &narrowed,
              sizeof(float));
}

class Validation : public ::testing::TestWithParam<Refusal> {};

TEST_P(Validation, RefusesAndNamesFieldAndValue) {
  Request request = MakeRequest();
  GetParam().change(request);
  ParticleStore store(1 << 20);
  ServerLimits limits;
  limits.max_image_size = 4096;
  limits.max_lights = 2;
  limits.max_outputs = 3;
  limits.max_output_bytes = 64 * kMiB;
  limits.max_reference_work = 1000;
  const auto job = ConvertRequest(request, store, limits, {});
  ASSERT_FALSE(job.ok());
  EXPECT_EQ(job.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(job.status().message()), StartsWith(GetParam().message));
  // And to programs in parts.
  const ErrorDetail detail = DetailOf(job.status());
  EXPECT_EQ(std::string(job.status().message()),
            detail.field + ": " + detail.value + ", allowed: " + detail.allowed);
  EXPECT_THAT(detail.reason,
              ::testing::AnyOf(v1::ERROR_REASON_INVALID_FIELD, v1::ERROR_REASON_LIMIT_EXCEEDED));
  EXPECT_FALSE(detail.retry_after.has_value());
}

std::string NameOf(const ::testing::TestParamInfo<Refusal>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(
    Camera, Validation,
    ::testing::Values(
        Refusal{"Unset", [](Request& r) { r.mutable_scene()->clear_camera(); },
                "scene.camera: unset"},
        Refusal{"ViewUnset", [](Request& r) { CameraOf(r).clear_view(); },
                "scene.camera.view: unset"},
        Refusal{"EyeUnset", [](Request& r) { CameraOf(r).mutable_look_at()->clear_eye(); },
                "scene.camera.look_at.eye: unset"},
        Refusal{"TargetUnset", [](Request& r) { CameraOf(r).mutable_look_at()->clear_target(); },
                "scene.camera.look_at.target: unset"},
        Refusal{"EyeNan",
                [](Request& r) { CameraOf(r).mutable_look_at()->mutable_eye()->set_y(kNan); },
                "scene.camera.look_at.eye.y: nan"},
        // Of such distances 32 bits have no squares, and 64 bits not always the distance.
        Refusal{"EyeTooFar",
                [](Request& r) { CameraOf(r).mutable_look_at()->mutable_eye()->set_x(1e300); },
                "scene.camera.look_at.eye.x: 1e+300, allowed: [-1e+18, 1e+18]"},
        Refusal{"TargetTooFar",
                [](Request& r) { CameraOf(r).mutable_look_at()->mutable_target()->set_x(-1e19); },
                "scene.camera.look_at.target.x: -1e+19, allowed: [-1e+18, 1e+18]"},
        Refusal{"MatrixTooFar",
                [](Request& r) {
                  UseMatrix(r, {1, 0, 0, 0, 0, 1, 0, 1e308, 0, 0, 1, 0, 0, 0, 0, 1});
                },
                "scene.camera.world_to_camera.elements[7]: 1e+308, allowed: [-1e+18, 1e+18]"},
        Refusal{"EyeIsTarget",
                [](Request& r) { CameraOf(r).mutable_look_at()->mutable_target()->set_z(10.0); },
                "scene.camera.look_at.target: (0, 0, 10)"},
        Refusal{"UpZero", [](Request& r) { CameraOf(r).mutable_look_at()->mutable_up(); },
                "scene.camera.look_at.up: (0, 0, 0)"},
        Refusal{"MatrixShort",
                [](Request& r) {
                  UseMatrix(r, {1, 0, 0});
                },
                "scene.camera.world_to_camera.elements: 3 numbers"},
        Refusal{"MatrixInfinite",
                [](Request& r) {
                  UseMatrix(r, {1, 0, 0, kInf, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
                },
                "scene.camera.world_to_camera.elements[3]: inf"},
        Refusal{"MatrixScales",
                [](Request& r) {
                  UseMatrix(r, {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
                },
                "scene.camera.world_to_camera: "},
        Refusal{"MatrixMirrors",
                [](Request& r) {
                  UseMatrix(r, {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
                },
                "scene.camera.world_to_camera: "},
        Refusal{"MatrixProjects",
                [](Request& r) {
                  UseMatrix(r, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1});
                },
                "scene.camera.world_to_camera: "},
        Refusal{"FovTooWide",
                [](Request& r) { CameraOf(r).mutable_perspective()->set_vertical_fov_deg(200); },
                "scene.camera.perspective.vertical_fov_deg: 200, allowed: [1e-06, 179)"},
        Refusal{"FovAtTheEnd",
                [](Request& r) { CameraOf(r).mutable_perspective()->set_vertical_fov_deg(179); },
                "scene.camera.perspective.vertical_fov_deg: 179"},
        // Pixels a unit are infinite in 32 bits.
        Refusal{"FovTooNarrow",
                [](Request& r) { CameraOf(r).mutable_perspective()->set_vertical_fov_deg(1e-300); },
                "scene.camera.perspective.vertical_fov_deg: 1e-300, allowed: [1e-06, 179)"},
        Refusal{"FovNegative",
                [](Request& r) { CameraOf(r).mutable_perspective()->set_vertical_fov_deg(-1); },
                "scene.camera.perspective.vertical_fov_deg: -1"},
        Refusal{"FovNan",
                [](Request& r) { CameraOf(r).mutable_perspective()->set_vertical_fov_deg(kNan); },
                "scene.camera.perspective.vertical_fov_deg: nan"},
        Refusal{"OrthographicWithoutHeight", [](Request& r) { CameraOf(r).mutable_orthographic(); },
                "scene.camera.orthographic.height: 0"},
        Refusal{"OrthographicTooSmall",
                [](Request& r) { CameraOf(r).mutable_orthographic()->set_height(1e-300); },
                "scene.camera.orthographic.height: 1e-300, allowed: [1e-15, 1e+18]"},
        Refusal{"TooWide", [](Request& r) { CameraOf(r).set_width(4097); },
                "scene.camera.width: 4097, allowed: [1, 4096]"},
        Refusal{"TooHigh", [](Request& r) { CameraOf(r).set_height(4294967295U); },
                "scene.camera.height: 4294967295"},
        Refusal{"CropEmpty", [](Request& r) { CameraOf(r).mutable_crop(); },
                "scene.camera.crop.width: pixels [0, 0)"},
        Refusal{"CropOutside",
                [](Request& r) {
                  CameraOf(r).mutable_crop()->set_x(60);
                  CameraOf(r).mutable_crop()->set_width(5);
                  CameraOf(r).mutable_crop()->set_height(5);
                },
                "scene.camera.crop.width: pixels [60, 65)"},
        Refusal{"CropOverflows",
                [](Request& r) {
                  CameraOf(r).mutable_crop()->set_width(1);
                  CameraOf(r).mutable_crop()->set_y(4294967295U);
                  CameraOf(r).mutable_crop()->set_height(2);
                },
                "scene.camera.crop.height: pixels [4294967295, 4294967297)"},
        Refusal{"SupersampleZero",
                [](Request& r) { r.mutable_scene()->mutable_sampling()->set_supersample(0); },
                "scene.sampling.supersample: 0, allowed: [1, 8]"},
        Refusal{"DownsampleTooHigh",
                [](Request& r) { r.mutable_scene()->mutable_sampling()->set_downsample(9); },
                "scene.sampling.downsample: 9"},
        Refusal{"SupersampledTooLarge",
                [](Request& r) {
                  CameraOf(r).set_width(2049);
                  r.mutable_scene()->mutable_sampling()->set_supersample(2);
                },
                "scene.sampling.supersample: 2 with a window of 2049 x 48"}),
    NameOf);

INSTANTIATE_TEST_SUITE_P(
    Lights, Validation,
    ::testing::Values(
        Refusal{"TooMany",
                [](Request& r) {
                  r.mutable_scene()->mutable_lighting()->add_lights();
                  r.mutable_scene()->mutable_lighting()->add_lights();
                },
                "scene.lighting.lights: 3 lights, allowed: at most 2"},
        Refusal{"KindUnset", [](Request& r) { LightOf(r).clear_kind(); },
                "scene.lighting.lights[0].kind: unset"},
        Refusal{"DirectionZero",
                [](Request& r) { LightOf(r).mutable_directional()->clear_direction(); },
                "scene.lighting.lights[0].directional.direction: (0, 0, 0)"},
        Refusal{
            "DirectionNan",
            [](Request& r) { LightOf(r).mutable_directional()->mutable_direction()->set_x(kNan); },
            "scene.lighting.lights[0].directional.direction.x: nan"},
        Refusal{"PositionUnset", [](Request& r) { LightOf(r).mutable_point(); },
                "scene.lighting.lights[0].point.position: unset"},
        Refusal{"PositionInfinite", [](Request& r) { UsePointLight(r, kInf); },
                "scene.lighting.lights[0].point.position.x: inf"},
        Refusal{"PositionTooFar", [](Request& r) { UsePointLight(r, 1e200); },
                "scene.lighting.lights[0].point.position.x: 1e+200, allowed: [-1e+18, 1e+18]"},
        Refusal{"PointAmongTheParticles", [](Request& r) { UsePointLight(r, 0.5); },
                "scene.lighting.lights[0].point.position: "},
        Refusal{"ColorNegative", [](Request& r) { LightOf(r).mutable_color()->set_g(-1.0F); },
                "scene.lighting.lights[0].color.g: -1, allowed: >= 0 and finite"},
        Refusal{"DensityNegative", [](Request& r) { LightOf(r).set_density(-0.5F); },
                "scene.lighting.lights[0].density: -0.5"},
        Refusal{
            "DensityOfOneChannelNan",
            [](Request& r) { LightOf(r).mutable_density_rgb()->set_b(static_cast<float>(kNan)); },
            "scene.lighting.lights[0].density_rgb.b: nan"}),
    NameOf);

INSTANTIATE_TEST_SUITE_P(
    MaterialAndShadow, Validation,
    ::testing::Values(
        Refusal{"ProfileUnknown",
                [](Request& r) { MaterialOf(r).set_profile(static_cast<v1::Profile>(9)); },
                "scene.material.profile: 9, allowed: PROFILE_SOFT, PROFILE_BALL"},
        Refusal{"RadiusMissing",
                [](Request& r) { UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION}); },
                "scene.material.radius: unset"},
        Refusal{"RadiusZero",
                [](Request& r) {
                  UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION});
                  MaterialOf(r).set_radius(0.0F);
                },
                "scene.material.radius: 0, allowed: [1e-15, 1e+17]"},
        Refusal{"OpacityAboveOne", [](Request& r) { MaterialOf(r).set_opacity(1.5F); },
                "scene.material.opacity: 1.5, allowed: [0, 1]"},
        Refusal{"AlbedoNegative", [](Request& r) { MaterialOf(r).mutable_albedo()->set_r(-0.5F); },
                "scene.material.albedo.r: -0.5"},
        Refusal{
            "EmissionInfinite",
            [](Request& r) { MaterialOf(r).mutable_emission()->set_r(static_cast<float>(kInf)); },
            "scene.material.emission.r: inf"},
        Refusal{"AmbientNegative",
                [](Request& r) { MaterialOf(r).mutable_ambient()->set_b(-0.5F); },
                "scene.material.ambient.b: -0.5"},
        Refusal{"PhaseAtTheEnd", [](Request& r) { MaterialOf(r).set_phase_g(1.0F); },
                "scene.material.phase_g: 1, allowed: (-1, 1)"},
        Refusal{"SpreadNegative", [](Request& r) { MaterialOf(r).set_scattering_spread(-1.0F); },
                "scene.material.scattering_spread: -1"},
        Refusal{
            "MeanCosineAtTheEnd",
            [](Request& r) { MaterialOf(r).mutable_physical_scattering()->set_mean_cosine(1.0F); },
            "scene.material.physical_scattering.mean_cosine: 1, allowed: [0, 1)"},
        Refusal{
            "MeanCosineBackward",
            [](Request& r) { MaterialOf(r).mutable_physical_scattering()->set_mean_cosine(-0.5F); },
            "scene.material.physical_scattering.mean_cosine: -0.5, allowed: [0, 1)"},
        Refusal{"ScatteringAlbedoAboveOne",
                [](Request& r) { MaterialOf(r).mutable_physical_scattering()->set_albedo(1.5F); },
                "scene.material.physical_scattering.albedo: 1.5, allowed: [0, 1]"},
        Refusal{"BothKindsOfScattering",
                [](Request& r) {
                  MaterialOf(r).set_scattering_spread(0.25F);
                  MaterialOf(r).mutable_physical_scattering()->set_mean_cosine(0.5F);
                },
                "scene.material.physical_scattering: set beside a scattering_spread of 0.25"},
        Refusal{"PhysicalScatteringByTexels",
                [](Request& r) {
                  MaterialOf(r).mutable_physical_scattering()->set_mean_cosine(0.5F);
                  ShadowOf(r).set_blur_mode(v1::BLUR_MODE_TEXELS_PER_SLICE);
                  ShadowOf(r).set_blur_texels(2.0F);
                },
                "scene.material.physical_scattering: set with a blur_mode of "
                "BLUR_MODE_TEXELS_PER_SLICE"},
        Refusal{"TimeWithoutVelocity",
                [](Request& r) { r.mutable_scene()->set_time_offset_s(0.5); },
                "scene.time_offset_s: 0.5"},
        // In 32 bits infinite, and times a velocity of zero no number: it would move nothing, far
        // away.
        Refusal{
            "TimeTooLarge",
            [](Request& r) {
              UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_VELOCITY});
              MaterialOf(r).set_radius(1.0F);
              for (size_t i = 6; i < 12; ++i) Poke(r, i, 0.0);
              r.mutable_scene()->set_time_offset_s(1e300);
            },
            "scene.time_offset_s: 1e+300, allowed: [-1e+17, 1e+17]"},
        Refusal{"TimeNan", [](Request& r) { r.mutable_scene()->set_time_offset_s(kNan); },
                "scene.time_offset_s: nan"},
        Refusal{"TechniqueUnknown",
                [](Request& r) { ShadowOf(r).set_technique(static_cast<v1::ShadowTechnique>(99)); },
                "scene.shadow.technique: 99, allowed: SHADOW_TECHNIQUE_HALF_ANGLE, "
                "SHADOW_TECHNIQUE_REFERENCE"},
        Refusal{"ReferenceOfTooMuch",
                [](Request& r) { ShadowOf(r).set_technique(v1::SHADOW_TECHNIQUE_REFERENCE); },
                "scene.shadow.technique: SHADOW_TECHNIQUE_REFERENCE of "},
        Refusal{"CompositorUnknown",
                [](Request& r) { ShadowOf(r).set_compositor(static_cast<v1::SliceCompositor>(7)); },
                "scene.shadow.compositor: 7, allowed: SLICE_COMPOSITOR_RASTER, "
                "SLICE_COMPOSITOR_TILES"},
        Refusal{"SpacingUnknown",
                [](Request& r) { ShadowOf(r).set_spacing(static_cast<v1::SliceSpacing>(-1)); },
                "scene.shadow.spacing: -1"},
        Refusal{"SlicesTooMany", [](Request& r) { ShadowOf(r).set_slices(65537); },
                "scene.shadow.slices: 65537, allowed: [1, 65536]"},
        Refusal{"LightBufferTooSmall", [](Request& r) { ShadowOf(r).set_light_buffer_size(15); },
                "scene.shadow.light_buffer_size: 15, allowed: [16, 4096]"},
        Refusal{"BlurModeUnknown",
                [](Request& r) { ShadowOf(r).set_blur_mode(static_cast<v1::BlurMode>(5)); },
                "scene.shadow.blur_mode: 5"},
        Refusal{"BlurTexelsWithoutMode", [](Request& r) { ShadowOf(r).set_blur_texels(2.0F); },
                "scene.shadow.blur_texels: 2, allowed: unset"},
        Refusal{"BlurModeWithoutTexels",
                [](Request& r) { ShadowOf(r).set_blur_mode(v1::BLUR_MODE_TEXELS_PER_SLICE); },
                "scene.shadow.blur_texels: 0"},
        Refusal{"BlurTooWide",
                [](Request& r) {
                  ShadowOf(r).set_blur_mode(v1::BLUR_MODE_TEXELS_PER_SLICE);
                  ShadowOf(r).set_blur_texels(65.0F);
                },
                "scene.shadow.blur_texels: 65"}),
    NameOf);

INSTANTIATE_TEST_SUITE_P(
    Outputs, Validation,
    ::testing::Values(
        Refusal{"None", [](Request& r) { r.clear_outputs(); }, "outputs: 0, allowed: [1, 3]"},
        Refusal{"TooMany",
                [](Request& r) {
                  for (int i = 0; i < 3; ++i) {
                    *r.add_outputs() = r.outputs(0);
                  }
                },
                "outputs: 4"},
        Refusal{"KindUnset", [](Request& r) { OutputOf(r).clear_kind(); },
                "outputs[0].kind: unset"},
        Refusal{"KindUnknown",
                [](Request& r) { OutputOf(r).set_kind(static_cast<v1::OutputKind>(77)); },
                "outputs[0].kind: 77"},
        Refusal{"FormatUnknown",
                [](Request& r) { OutputOf(r).set_format(static_cast<v1::ImageFormat>(77)); },
                "outputs[0].format: 77"},
        Refusal{"CompressionUnknown",
                [](Request& r) {
                  OutputOf(r).set_format(v1::IMAGE_FORMAT_EXR_HALF);
                  OutputOf(r).set_compression(static_cast<v1::ExrCompression>(77));
                },
                "outputs[0].compression: 77"},
        Refusal{"CompressionOfPng",
                [](Request& r) { OutputOf(r).set_compression(v1::EXR_COMPRESSION_ZIP); },
                "outputs[0].compression: 4, allowed: unset"},
        Refusal{"QuantityOfBeauty",
                [](Request& r) { OutputOf(r).set_quantity(v1::LIGHT_QUANTITY_OPTICAL_DEPTH); },
                "outputs[0].quantity: 2, allowed: unset"},
        Refusal{"QuantityUnknown",
                [](Request& r) {
                  OutputOf(r).set_kind(v1::OUTPUT_KIND_LIGHT_BUFFER);
                  OutputOf(r).set_quantity(static_cast<v1::LightQuantity>(77));
                },
                "outputs[0].quantity: 77"},
        Refusal{"LightOfBeauty", [](Request& r) { OutputOf(r).set_light_index(1); },
                "outputs[0].light_index: 1, allowed: unset"},
        Refusal{"LightOutOfRange",
                [](Request& r) {
                  OutputOf(r).set_kind(v1::OUTPUT_KIND_LIGHT_TRANSMITTANCE);
                  OutputOf(r).set_light_index(1);
                },
                "outputs[0].light_index: 1, allowed: [0, 0]"},
        Refusal{"LightWithoutShadows",
                [](Request& r) {
                  LightOf(r).set_density(0.0F);
                  OutputOf(r).set_kind(v1::OUTPUT_KIND_LIGHT_BUFFER);
                },
                "outputs[0].light_index: 0, allowed: a light whose shadow density is not 0"},
        Refusal{"LightOfADarkScene",
                [](Request& r) {
                  r.mutable_scene()->clear_lighting();
                  OutputOf(r).set_kind(v1::OUTPUT_KIND_LIGHT_BUFFER);
                },
                "outputs[0].light_index: 0, allowed: nothing"},
        Refusal{"TooManyBytes",
                [](Request& r) {
                  // 4096^2 texels of one float: exactly the limit; the second output goes over it.
                  OutputOf(r).set_kind(v1::OUTPUT_KIND_LIGHT_BUFFER);
                  ShadowOf(r).set_light_buffer_size(4096);
                  r.add_outputs()->set_kind(v1::OUTPUT_KIND_COVERAGE);
                },
                "outputs: 67121152 bytes"},
        Refusal{"TooManyBytesOfLayers",
                [](Request& r) {
                  // Two particles: two layers, of three channels.
                  OutputOf(r).set_kind(v1::OUTPUT_KIND_LIGHT_LAYERS);
                  LightOf(r).mutable_density_rgb()->set_r(1.0F);
                  ShadowOf(r).set_light_buffer_size(2048);
                },
                "outputs: 100663296 bytes"},
        Refusal{"ErrorOfTooMuch",
                [](Request& r) {
                  r.add_outputs()->set_kind(v1::OUTPUT_KIND_DEPTH);
                  r.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
                },
                "outputs[2].kind: OUTPUT_KIND_ERROR of 65536 samples times 2 particles"},
        Refusal{"LightOfTheError",
                [](Request& r) {
                  OutputOf(r).set_kind(v1::OUTPUT_KIND_ERROR);
                  OutputOf(r).set_light_index(1);
                },
                "outputs[0].light_index: 1, allowed: unset"},
        Refusal{"MeasuredPixelsTooFew",
                [](Request& r) { r.mutable_measure_error()->set_samples(31); },
                "measure_error.samples: 31, allowed: [32, 1048576]"},
        Refusal{"MeasuredPixelsTooMany",
                [](Request& r) { r.mutable_measure_error()->set_samples(1048577); },
                "measure_error.samples: 1048577, allowed: [32, 1048576]"},
        Refusal{
            "MeasurementOfTooMuch", [](Request& r) { r.mutable_measure_error(); },
            "measure_error: a measurement of 65536 samples times 2 particles, allowed: a product "
            "of at most 1000"},
        Refusal{"RequestIdTooLong", [](Request& r) { r.set_request_id(std::string(129, 'a')); },
                "request_id: 129 bytes"},
        Refusal{"RequestIdUnprintable", [](Request& r) { r.set_request_id("a\nb"); },
                "request_id: byte 0x0a at 1"}),
    NameOf);

INSTANTIATE_TEST_SUITE_P(
    Particles, Validation,
    ::testing::Values(
        Refusal{"Unset", [](Request& r) { r.mutable_scene()->clear_particles(); },
                "scene.particles: unset"},
        Refusal{"NameTooShort", [](Request& r) { r.mutable_scene()->set_particle_sha256("abc"); },
                "scene.particle_sha256: 3 bytes, allowed: 32 bytes"},
        Refusal{"NoPosition", [](Request& r) { UseParticles(r, {v1::PARTICLE_ATTRIBUTE_RADIUS}); },
                "scene.inline_particles.layout.attributes: no PARTICLE_ATTRIBUTE_POSITION"},
        Refusal{"AttributeTwice",
                [](Request& r) {
                  ParticlesOf(r).mutable_layout()->add_attributes(v1::PARTICLE_ATTRIBUTE_RADIUS);
                },
                "scene.inline_particles.layout.attributes[2]: PARTICLE_ATTRIBUTE_RADIUS"},
        Refusal{"AttributeUnknown",
                [](Request& r) {
                  ParticlesOf(r).mutable_layout()->add_attributes(
                      static_cast<v1::ParticleAttribute>(40));
                },
                "scene.inline_particles.layout.attributes[2]: 40"},
        Refusal{"OriginNan",
                [](Request& r) { ParticlesOf(r).mutable_layout()->mutable_origin()->set_z(kNan); },
                "scene.inline_particles.layout.origin.z: nan"},
        Refusal{"OriginTooFar",
                [](Request& r) { ParticlesOf(r).mutable_layout()->mutable_origin()->set_x(1e18); },
                "scene.inline_particles.layout.origin.x: 1e+18, allowed: [-1e+17, 1e+17]"},
        Refusal{"PayloadShort", [](Request& r) { ParticlesOf(r).mutable_payload()->pop_back(); },
                "scene.inline_particles.payload: 31 bytes, allowed: 32 bytes"},
        Refusal{"PositionNan", [](Request& r) { Poke(r, 4, kNan); },
                "scene.inline_particles.position[1].y: nan, allowed: [-1e+17, 1e+17]"},
        // Squares of such lengths are infinite in 32 bits: the frame would be empty without a word.
        Refusal{"PositionTooFar", [](Request& r) { Poke(r, 0, 1e20); },
                "scene.inline_particles.position[0].x: 1e+20, allowed: [-1e+17, 1e+17]"},
        Refusal{"RadiusTooLarge", [](Request& r) { Poke(r, 6, 1e20); },
                "scene.inline_particles.radius[0]: 1e+20, allowed: [1e-15, 1e+17]"},
        Refusal{"RadiusTooSmall", [](Request& r) { Poke(r, 6, 1e-20); },
                "scene.inline_particles.radius[0]: 1e-20, allowed: [1e-15, 1e+17]"},
        Refusal{
            "MovedTooFar",
            [](Request& r) {
              UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_VELOCITY});
              MaterialOf(r).set_radius(1.0F);
              Poke(r, 9, 1e10);
              r.mutable_scene()->set_time_offset_s(1e9);
            },
            "scene.time_offset_s: 1000000000, which moves particle 1 to"},
        Refusal{"PositionInfinite", [](Request& r) { Poke(r, 2, -kInf); },
                "scene.inline_particles.position[0].z: -inf, allowed: [-1e+17, 1e+17]"},
        Refusal{"RadiusNan", [](Request& r) { Poke(r, 7, kNan); },
                "scene.inline_particles.radius[1]: nan"},
        Refusal{"RadiusInfinite", [](Request& r) { Poke(r, 6, kInf); },
                "scene.inline_particles.radius[0]: inf"},
        Refusal{"RadiusDenormal", [](Request& r) { Poke(r, 7, 1e-40); },
                "scene.inline_particles.radius[1]: 1e-40, allowed: [1e-15, 1e+17]"},
        Refusal{
            "OpacityNan",
            [](Request& r) {
              UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_OPACITY});
              Poke(r, 6, kNan);
            },
            "scene.inline_particles.opacity[0]: nan, allowed: [0, 1]"},
        Refusal{
            "EmissionInfinite",
            [](Request& r) {
              UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_EMISSION});
              Poke(r, 10, kInf);
            },
            "scene.inline_particles.emission[1].g: inf"},
        Refusal{"RadiusZero", [](Request& r) { Poke(r, 7, 0.0); },
                "scene.inline_particles.radius[1]: 0, allowed: [1e-15, 1e+17]"},
        Refusal{"RadiusNegative", [](Request& r) { Poke(r, 6, -2.0); },
                "scene.inline_particles.radius[0]: -2"},
        Refusal{
            "OpacityAboveOne",
            [](Request& r) {
              UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_OPACITY});
              Poke(r, 7, 1.25);
            },
            "scene.inline_particles.opacity[1]: 1.25, allowed: [0, 1]"},
        Refusal{"ColorNegative",
                [](Request& r) {
                  UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_COLOR});
                  Poke(r, 11, -1.0);
                },
                "scene.inline_particles.color[1].b: -1"},
        Refusal{
            "VelocityInfinite",
            [](Request& r) {
              UseParticles(r, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_VELOCITY});
              Poke(r, 6, kInf);
            },
            "scene.inline_particles.velocity[0].x: inf"}),
    NameOf);

INSTANTIATE_TEST_SUITE_P(
    Target, Validation,
    ::testing::Values(
        Refusal{"NamesNothing", [](Request& r) { r.mutable_target(); },
                "target: neither max_error nor max_time_ms"},
        Refusal{"ErrorZero", [](Request& r) { r.mutable_target()->set_max_error(0.0); },
                "target.max_error: 0"},
        Refusal{"ErrorAboveOne", [](Request& r) { r.mutable_target()->set_max_error(1.5); },
                "target.max_error: 1.5"},
        Refusal{"ErrorNan", [](Request& r) { r.mutable_target()->set_max_error(kNan); },
                "target.max_error: nan"},
        Refusal{"TimeZero", [](Request& r) { r.mutable_target()->set_max_time_ms(0.0); },
                "target.max_time_ms: 0"},
        Refusal{"TimeInfinite", [](Request& r) { r.mutable_target()->set_max_time_ms(kInf); },
                "target.max_time_ms: inf"},
        Refusal{"BesideSettings",
                [](Request& r) {
                  r.mutable_target()->set_max_time_ms(5.0);
                  ShadowOf(r).set_slices(3);
                },
                "scene.shadow: set"},
        Refusal{"TooMuchToMeasure", [](Request& r) { r.mutable_target()->set_max_error(0.5); },
                "target.max_error: a measurement of 65536 samples times 2 particles"}),
    NameOf);

TEST(Validation, PointLightMayStandAmongParticlesWhereNothingIsShadowed) {
  Request request = MakeRequest();
  UsePointLight(request, 0.5);
  LightOf(request).set_density(0.0F);
  ParticleStore store(1 << 20);
  EXPECT_TRUE(ConvertRequest(request, store, ServerLimits{}, {}).ok());
  UsePointLight(request, 50.0);
  LightOf(request).set_density(1.0F);
  EXPECT_TRUE(ConvertRequest(request, store, ServerLimits{}, {}).ok());
}

TEST(Validation, UnknownSetIsNotFoundByItsHexadecimalName) {
  Request request = MakeRequest();
  request.mutable_scene()->set_particle_sha256(std::string(32, '\xab'));
  ParticleStore store(1 << 20);
  const auto job = ConvertRequest(request, store, ServerLimits{}, {});
  EXPECT_EQ(job.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(job.status().message()), ::testing::HasSubstr("abababab"));
}

// Found by fuzzing: with a crop the rest of the picture was held to nothing.
TEST(Validation, SizeThatIsUnsetIsHeldToTheLimitToo) {
  Request request = MakeRequest();
  CameraOf(request).clear_width();
  CameraOf(request).mutable_crop()->set_width(8);
  CameraOf(request).mutable_crop()->set_height(8);
  ParticleStore store(1 << 20);
  ServerLimits limits;
  limits.max_image_size = 128;
  const auto job = ConvertRequest(request, store, limits, {});
  EXPECT_THAT(std::string(job.status().message()),
              StartsWith("scene.camera.width: 640, allowed: [1, 128]"));
}

TEST(Validation, TooManyParticlesAreRefusedForGood) {
  Request request = MakeRequest();
  ParticleStore store(1 << 20);
  ServerLimits limits;
  limits.max_particles = 1;
  const auto job = ConvertRequest(request, store, limits, {});
  EXPECT_EQ(job.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DetailOf(job.status()).reason, v1::ERROR_REASON_LIMIT_EXCEEDED);
}

}  // namespace
}  // namespace halflight
