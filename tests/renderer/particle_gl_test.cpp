// Single particles against the closed form of the image model.
#include <gtest/gtest.h>

#include <cmath>

#include "shaders/bindings.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using test::PixelAt;

struct ParticleCase {
  const char* name;
  glm::dvec3 eye;
  glm::vec3 center;
  float radius;
  float opacity;
  Profile profile;
  bool orthographic = false;
  double fov_deg = 40.0;
};

// Coverage at a pixel, from the definition: the ray's impact parameter as a cross product in
// float64.
double ExpectedCoverage(const ParticleCase& c, const Camera& camera, int x, int y) {
  const double ndc_x = 2.0 * (x + 0.5) / camera.width - 1.0;
  const double ndc_y = 1.0 - 2.0 * (y + 0.5) / camera.height;
  const double aspect = static_cast<double>(camera.width) / camera.height;
  const glm::dmat4 world_from_view = glm::inverse(camera.view_from_world);
  glm::dvec3 start(world_from_view[3]);
  glm::dvec3 ray;
  if (c.orthographic) {
    start += glm::dmat3(world_from_view) * glm::dvec3(ndc_x * aspect, ndc_y, 0.0);
    ray = glm::dmat3(world_from_view) * glm::dvec3(0, 0, -1);
  } else {
    const double slope = std::tan(0.5 * c.fov_deg * test::kDegree);
    ray = glm::normalize(glm::dmat3(world_from_view) *
                         glm::dvec3(ndc_x * aspect * slope, ndc_y * slope, -1.0));
  }
  const glm::dvec3 to_center = glm::dvec3(c.center) - start;
  if (glm::dot(to_center, ray) <= 0.0) return 0.0;
  const double rho = glm::length(glm::cross(to_center, ray)) / c.radius;
  if (rho >= 1.0) return 0.0;
  const double w = c.profile == Profile::kSoft ? 1.0 - rho * rho : std::sqrt(1.0 - rho * rho);
  return -std::expm1(std::log1p(-static_cast<double>(c.opacity)) * w);
}

using ManyParticles = test::GlTest;

class OneParticle : public test::GlTest, public testing::WithParamInterface<ParticleCase> {};

TEST_P(OneParticle, CoversWhatTheClosedFormSays) {
  const ParticleCase& c = GetParam();
  Scene scene;
  auto set = std::make_shared<ParticleSet>();
  set->positions = {c.center};
  scene.particles = set;
  scene.camera = test::LookAt(c.eye, {0, 0, 0}, 64, 48);
  if (c.orthographic) {
    scene.camera.projection = Orthographic{2.0};
  } else {
    scene.camera.projection = Perspective{c.fov_deg * test::kDegree};
  }
  scene.material.radius = c.radius;
  scene.material.opacity = c.opacity;
  scene.material.profile = c.profile;
  const Image image = RenderBeauty(scene);
  double largest_error = 0.0;
  double covered = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double expected = ExpectedCoverage(c, scene.camera, x, y);
      covered += expected;
      largest_error = std::max(largest_error, std::abs(PixelAt(image, x, y)[3] - expected));
    }
  }
  ASSERT_GT(covered, 0.0) << "the case shows nothing";
  RecordProperty("largest_error", std::to_string(largest_error));
  EXPECT_LT(largest_error, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(
    Cases, OneParticle,
    testing::Values(
        ParticleCase{"Soft", {0, 0, 3}, {0.1F, 0.2F, 0}, 0.5F, 0.4F, Profile::kSoft},
        ParticleCase{"Ball", {0, 0, 3}, {0.1F, 0.2F, 0}, 0.5F, 0.4F, Profile::kBall},
        ParticleCase{"NearlyOpaque", {0, 0, 3}, {0, 0, 0}, 0.5F, 0.999F, Profile::kSoft},
        ParticleCase{"Slanted", {2, 2, 1}, {0.3F, 0.1F, -0.2F}, 0.5F, 0.7F, Profile::kSoft},
        ParticleCase{"NearTheCorner", {0, 0, 3}, {1.2F, 0.9F, 0}, 0.4F, 0.7F, Profile::kSoft},
        ParticleCase{"FarAndSmall", {0, 0, 3000}, {1.0F, 0.5F, 0}, 60.0F, 0.7F, Profile::kSoft},
        ParticleCase{
            "Telescope", {0, 0, 3000}, {1.0F, 0.5F, 0}, 4.0F, 0.7F, Profile::kSoft, false, 1.0},
        ParticleCase{
            "WideAngle", {0, 0, 1}, {0.5F, 0.5F, 0.9F}, 0.3F, 0.7F, Profile::kSoft, false, 170.0},
        ParticleCase{"ContainsTheEye", {0, 0, 3}, {0.1F, 0, 2.9F}, 0.5F, 0.7F, Profile::kSoft},
        ParticleCase{"AroundTheEyePlane",
                     {0, 0, 3},
                     {0.4F, 0, 3.05F},
                     0.41F,
                     0.9F,
                     Profile::kSoft,
                     false,
                     170.0},
        ParticleCase{"CentreBehindTheEye",
                     {0, 0, 3},
                     {0.2F, 0.1F, 3.05F},
                     0.5F,
                     0.9F,
                     Profile::kBall,
                     false,
                     150.0},
        ParticleCase{"Faint", {0, 0, 3}, {0, 0, 0}, 0.5F, 1e-3F, Profile::kSoft},
        ParticleCase{
            "Orthographic", {0, 0, 3}, {0.3F, -0.2F, 0}, 0.5F, 0.6F, Profile::kSoft, true}),
    [](const auto& param) { return param.param.name; });

class Particles : public test::GlTest {};

TEST_F(Particles, OfTinyOpacityKeepTheirDigits) {
  Scene scene;
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{0, 0, 0}};
  scene.particles = set;
  scene.camera = test::LookAt({0, 0, 3}, {0, 0, 0}, 33, 33);
  scene.material.radius = 0.5F;
  scene.material.opacity = 1e-6F;
  EXPECT_NEAR(PixelAt(RenderBeauty(scene), 16, 16)[3], 1e-6, 1e-11);
}

TEST_F(Particles, BehindOneAnotherMultiplyWhatTheyLetThrough) {
  for (const int count : {1, 2, 7, 50}) {
    Scene scene;
    auto set = std::make_shared<ParticleSet>();
    for (int k = 0; k < count; ++k)
      set->positions.emplace_back(0, 0, -0.01F * static_cast<float>(k));
    scene.particles = set;
    scene.camera = test::LookAt({0, 0, 3}, {0, 0, 0}, 33, 33);
    scene.lights = {test::Sun({1, -1, -1})};
    scene.material.radius = 0.5F;
    scene.material.opacity = 0.1F;
    EXPECT_NEAR(PixelAt(RenderBeauty(scene), 16, 16)[3], 1.0 - std::pow(0.9, count), 1e-6) << count;
  }
}

TEST_F(Particles, BehindTheEyeAreNotSeen) {
  Scene scene;
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{0, 0, 5}, {0, 0, 3.6F}};
  scene.particles = set;
  scene.camera = test::LookAt({0, 0, 3}, {0, 0, 0}, 32, 32);
  scene.material.radius = 0.5F;
  const Image image = RenderBeauty(scene);
  for (const float value : image.pixels) ASSERT_EQ(value, 0.0F);
}

TEST_F(Particles, OfOpacityOneAreClampedAndCounted) {
  Scene scene = test::BallScene(3);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->opacities = {1.0F, 0.5F, 1.0F};
  scene.particles = set;
  const FrameResult frame = Render(test::Beauty(scene));
  EXPECT_EQ(frame.clamped_opacities, 2U);
  for (const float value : frame.images[0].pixels) ASSERT_TRUE(std::isfinite(value));
}

// More than fit in the storage block (2^27 bytes) and in the row of groups (65,535) that GL
// guarantees: the last of them, farthest away, is drawn like the first.
TEST_F(ManyParticles, AreDrawnToTheLast) {
  constexpr size_t kCount = size_t{65536} * shader::kProjectGroupSize + 1000;
  static_assert(kCount * sizeof(shader::Splat) > size_t{1} << 27U);
  auto set = std::make_shared<ParticleSet>();
  set->positions.assign(kCount, glm::vec3(100.0F, 0.0F, 0.0F));  // beside the image
  set->positions.back() = {0.0F, 0.0F, -200.0F};
  Scene scene;
  scene.particles = set;
  scene.camera = test::LookAt({0, 0, 4}, {0, 0, 0}, 17, 17);
  scene.material.radius = 40.0F;
  scene.material.opacity = 0.5F;
  scene.shadow.technique = ShadowTechniqueKind::kHalfAngle;
  const Image beauty = RenderBeauty(scene);
  EXPECT_NEAR(PixelAt(beauty, 8, 8)[3], 0.5F, 1e-6);
}

}  // namespace
}  // namespace halflight
