// Properties of whole frames that hold whatever the technique's error.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using test::MaxDifference;
using test::PixelAt;

class Frame : public test::GlTest {};

TEST_F(Frame, IsTheSameToTheByteWhenAskedForTwice) {
  const Scene scene = test::BallScene(3000);
  const Image once = RenderBeauty(scene);
  const Image again = RenderBeauty(scene);
  EXPECT_EQ(
      0, std::memcmp(once.pixels.data(), again.pixels.data(), once.pixels.size() * sizeof(float)));
}

TEST_F(Frame, WithoutShadowsInOneColourDoesNotDependOnOrderOrAxis) {
  // With no density the light adds the same everywhere; with density zero no axis is chosen at all.
  Scene scene = test::BallScene(2000);
  scene.lights = {test::Sun({1, -1, -0.5}, 0.0F)};
  const Image by_distance = RenderBeauty(scene);
  for (const glm::dvec3& direction :
       {glm::dvec3(0, 0, -1), glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0), glm::dvec3(0.3, -1, 0.2)}) {
    scene.lights = {test::Sun(direction, 1e-30F)};
    EXPECT_LT(MaxDifference(RenderBeauty(scene), by_distance), 2e-5);
  }
}

TEST_F(Frame, WithShadowDensityZeroIsNotChangedByShadowSettings) {
  Scene scene = test::BallScene(2000);
  scene.lights = {test::Sun({1, -1, -0.5}, 0.0F)};
  const Image before = RenderBeauty(scene);
  scene.shadow = {.slices = 7, .interpolate = false, .light_buffer_size = 32};
  EXPECT_EQ(MaxDifference(RenderBeauty(scene), before), 0.0);
}

TEST_F(Frame, CoversTheSameWhateverTheSlices) {
  Scene scene = test::BallScene(1001);
  scene.shadow.slices = 1001;
  const Image all = RenderBeauty(scene);
  for (const int slices : {1, 32, 33, 1000}) {
    scene.shadow.slices = slices;
    for (const SliceSpacing spacing :
         {SliceSpacing::kEqualCount, SliceSpacing::kEqualOpticalDepth}) {
      scene.shadow.spacing = spacing;
      const Image image = RenderBeauty(scene);
      for (size_t i = 3; i < image.pixels.size(); i += 4) {
        ASSERT_NEAR(image.pixels[i], all.pixels[i], 1e-6) << slices;
      }
    }
  }
}

TEST_F(Frame, LooksFromAnySideOfTheLight) {
  // Parallel, antiparallel and perpendicular to the view: finite, covered, shadowed.
  for (const glm::dvec3& direction :
       {glm::dvec3(0, 0, -1), glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0),
        glm::dvec3(0, 1, 0)}) {
    Scene scene = test::BallScene(2000);
    scene.lights = {test::Sun(direction)};
    const Image shadowed = RenderBeauty(scene);
    scene.lights = {test::Sun(direction, 0.0F)};
    const Image unshadowed = RenderBeauty(scene);
    double sum_shadowed = 0.0;
    double sum_unshadowed = 0.0;
    for (size_t i = 0; i < shadowed.pixels.size(); i += 4) {
      ASSERT_TRUE(std::isfinite(shadowed.pixels[i]));
      ASSERT_NEAR(shadowed.pixels[i + 3], unshadowed.pixels[i + 3], 1e-5);
      sum_shadowed += shadowed.pixels[i];
      sum_unshadowed += unshadowed.pixels[i];
    }
    EXPECT_LT(sum_shadowed, sum_unshadowed);
    // Darker seen from behind than from the light's side.
    if (direction.z > 0.5) {
      EXPECT_LT(sum_shadowed, 0.4 * sum_unshadowed);
    }
    if (direction.z < -0.5) {
      EXPECT_GT(sum_shadowed, 0.6 * sum_unshadowed);
    }
  }
}

TEST_F(Frame, IsDarkOnTheSideAwayFromTheLight) {
  Scene scene = test::BallScene(4000);
  scene.material.opacity = 0.6F;
  scene.lights = {test::Sun({1, 0, 0})};  // travels to the right
  const Image image = RenderBeauty(scene);
  const float left = PixelAt(image, 30, 48)[0] / PixelAt(image, 30, 48)[3];
  const float right = PixelAt(image, 66, 48)[0] / PixelAt(image, 66, 48)[3];
  EXPECT_GT(left, 2.0F * right);
  scene.lights = {test::Sun({0, -1, 0})};  // travels down; row 0 is the top
  const Image from_above = RenderBeauty(scene);
  EXPECT_GT(PixelAt(from_above, 48, 30)[0], 2.0F * PixelAt(from_above, 48, 66)[0]);
}

TEST_F(Frame, OfAWindowIsThatPartOfTheWhole) {
  Scene scene = test::BallScene(1500);
  const Image whole = RenderBeauty(scene);
  scene.camera.window = {20, 31, 40, 25};
  const Image part = RenderBeauty(scene);
  ASSERT_EQ(part.width, 40);
  ASSERT_EQ(part.height, 25);
  for (int y = 0; y < part.height; ++y) {
    for (int x = 0; x < part.width; ++x) {
      for (int c = 0; c < 4; ++c) {
        ASSERT_NEAR(PixelAt(part, x, y)[c], PixelAt(whole, x + 20, y + 31)[c], 1e-4);
      }
    }
  }
}

TEST_F(Frame, AtTenMillionUnitsIsTheFrameAtZero) {
  Scene scene = test::BallScene(1500);
  const Image here = RenderBeauty(scene);
  const glm::dvec3 far(1e7, -1e7, 1e7);
  auto moved = std::make_shared<ParticleSet>(*scene.particles);
  moved->origin += far;
  scene.particles = moved;
  scene.camera = test::LookAt(far + glm::dvec3(0, 0, 4), far, 96, 96);
  EXPECT_LT(MaxDifference(RenderBeauty(scene), here), 1e-4);
}

TEST_F(Frame, AdvancesParticlesByTheirVelocity) {
  Scene scene = test::BallScene(500);
  auto moving = std::make_shared<ParticleSet>(*scene.particles);
  auto moved = std::make_shared<ParticleSet>(*scene.particles);
  moving->velocities.assign(moving->size(), {0.5F, -0.25F, 0.0F});
  for (glm::vec3& position : moved->positions) position += glm::vec3(0.25F, -0.125F, 0.0F);
  scene.particles = moved;
  const Image expected = RenderBeauty(scene);
  scene.particles = moving;
  scene.time_offset_s = 0.5;
  EXPECT_LT(MaxDifference(RenderBeauty(scene), expected), 1e-6);
}

TEST_F(Frame, TakesAttributesOfParticlesOverTheMaterials) {
  Scene uniform = test::BallScene(300);
  uniform.material.albedo = {0.5F, 0.25F, 0.125F};
  uniform.material.emission = {0.1F, 0.2F, 0.3F};
  Scene own = uniform;
  auto set = std::make_shared<ParticleSet>(*own.particles);
  set->radii.assign(set->size(), uniform.material.radius);
  set->opacities.assign(set->size(), uniform.material.opacity);
  set->colors.assign(set->size(), {0.5F, 0.25F, 0.125F});
  set->emissions.assign(set->size(), {0.1F, 0.2F, 0.3F});
  own.particles = set;
  own.material = {};
  EXPECT_LT(MaxDifference(RenderBeauty(own), RenderBeauty(uniform)), 1e-6);
}

TEST_F(Frame, WithTwoLightsIsTheSumOfBoth) {
  Scene scene = test::BallScene(1500);
  const Light sun = test::Sun({1, -1, -0.5});
  const Light moon = test::Sun({-1, -0.2, 0.4}, 2.0F);
  scene.material.emission = {0.01F, 0.02F, 0.03F};
  scene.lights = {sun, moon};
  const Image both = RenderBeauty(scene);
  scene.lights = {sun};
  const Image one = RenderBeauty(scene);
  scene.lights = {moon};
  scene.material.ambient = glm::vec3(0.0F);
  scene.material.emission = glm::vec3(0.0F);
  const Image other = RenderBeauty(scene);
  for (size_t i = 0; i < both.pixels.size(); ++i) {
    const float expected = i % 4 == 3 ? one.pixels[i] : one.pixels[i] + other.pixels[i];
    ASSERT_NEAR(both.pixels[i], expected, 1e-5);
  }
}

TEST_F(Frame, OfNoParticlesIsEmpty) {
  Scene scene = test::BallScene(0);
  FrameRequest request = test::Beauty(scene);
  request.images = {{ImageKind::kBeauty},
                    {ImageKind::kDepth},
                    {ImageKind::kLightTransmittance},
                    {ImageKind::kLightBuffer}};
  const FrameResult frame = Render(request);
  for (const float value : frame.images[0].pixels) ASSERT_EQ(value, 0.0F);
  for (const float value : frame.images[1].pixels) ASSERT_TRUE(std::isinf(value));
  for (const float value : frame.images[2].pixels) ASSERT_EQ(value, 1.0F);
  for (const float value : frame.images[3].pixels) ASSERT_EQ(value, 1.0F);
}

TEST_F(Frame, IsCancelledWhenAskedTo) {
  std::stop_source stop;
  stop.request_stop();
  const auto frame = Renderer().Render(test::Beauty(test::BallScene(100)), stop.get_token());
  EXPECT_EQ(frame.status().code(), absl::StatusCode::kCancelled);
}

TEST_F(Frame, SeenAlongParallelRaysIsOrderedByDepth) {
  // The second lies deeper, but nearer to the middle of the image.
  Scene scene = test::BallScene(0);
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{1.0F, 0.0F, 0.1F}, {0.8F, 0.0F, 0.0F}};
  set->colors = {{1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}};
  scene.particles = set;
  scene.camera = test::LookAt({0, 0, 1.5}, {0, 0, 0}, 97, 97);
  scene.camera.projection = Orthographic{2.4};
  scene.material.radius = 0.3F;
  scene.material.opacity = 0.9F;
  for (const float density : {0.0F, 1e-30F}) {
    scene.lights = {test::Sun({0, 0, -1}, density)};
    const Image image = RenderBeauty(scene);
    const float* pixel = PixelAt(image, 48 + 36, 48);
    EXPECT_GT(pixel[0], 2.0F * pixel[1]) << density;
  }
}

TEST_F(Frame, DoesNotReportWhatOneThatEndedEarlyLeftBehind) {
  const Scene scene = test::BallScene(10);
  Renderer();
  glEnable(0xFFFFFFFF);  // an error of GL, pending
  EXPECT_TRUE(Renderer().Render(test::Beauty(scene), {}).ok());
  EXPECT_EQ(glGetError(), GLenum{GL_NO_ERROR});
}

TEST_F(Frame, OfALightAmongTheParticlesIsRefusedByName) {
  Scene scene = test::BallScene(100);
  scene.lights.push_back(test::Sun({1, 0, 0}));
  // In the middle, beside it, and where only the outermost reach.
  for (const double z : {0.0, 0.5, 0.9}) {
    scene.lights[1].kind = PointLight{{0.0, 0.0, z}};
    const absl::Status status = Renderer().Render(test::Beauty(scene), {}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_NE(status.message().find("lighting.lights[1].point.position: (0, 0, "),
              std::string::npos)
        << status;
  }
  scene.lights[1].shadow_density = glm::vec3(0.0F);  // it may stand anywhere
  EXPECT_TRUE(Renderer().Render(test::Beauty(scene), {}).ok());
}

TEST_F(Frame, OfNoParticlesAtTheLightsPlaceReportsNumbers) {
  Scene scene = test::BallScene(0);
  scene.lights[0].kind = PointLight{{0.0, 0.0, 0.0}};
  const FrameResult frame = Render({scene, {{ImageKind::kLightBuffer}}});
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) {
      EXPECT_TRUE(std::isfinite(frame.lights.at(0).light_texture_from_world[column][row]));
    }
  }
}

}  // namespace
}  // namespace halflight
