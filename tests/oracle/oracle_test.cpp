// The oracle against closed forms, and against the definitions written out without any index.
#include "tests/oracle/oracle.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/oracle/half_angle.h"
#include "tests/oracle/image_error.h"
#include "tests/oracle/plume.h"

namespace halflight::oracle {
namespace {

// A square image of odd size, whose middle pixel looks along world -z from (0, 0, 10).
Scene EmptyScene(int size = 33) {
  Scene scene;
  scene.particles = std::make_shared<ParticleSet>();
  scene.camera.view_from_world = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.0, -10.0));
  scene.camera.projection = Perspective{0.4};
  scene.camera.width = scene.camera.height = size;
  scene.camera.window = {0, 0, size, size};
  scene.material.radius = 1.0F;
  scene.material.opacity = 0.5F;
  scene.material.ambient = glm::vec3(0.0F);
  return scene;
}

Scene SceneOf(std::vector<glm::vec3> positions, int size = 33) {
  Scene scene = EmptyScene(size);
  auto set = std::make_shared<ParticleSet>();
  set->positions = std::move(positions);
  scene.particles = set;
  return scene;
}

glm::dvec4 MiddlePixel(const OracleImage& image) { return image.rgba[image.rgba.size() / 2]; }

// Particles of random place, radius, opacity and colour in a box round the origin.
Scene RandomScene(size_t count, int size, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> signed_unit(-1.0F, 1.0F);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  auto set = std::make_shared<ParticleSet>();
  for (size_t i = 0; i < count; ++i) {
    set->positions.emplace_back(signed_unit(random), signed_unit(random), signed_unit(random));
    set->radii.push_back(0.1F + 0.5F * unit(random) * unit(random));
    set->opacities.push_back(0.7F * unit(random));
    set->colors.emplace_back(unit(random), unit(random), unit(random));
    set->emissions.emplace_back(0.1F * unit(random), 0.0F, 0.0F);
    set->velocities.emplace_back(0.0F, signed_unit(random), 0.0F);
  }
  Scene scene = EmptyScene(size);
  scene.particles = set;
  scene.material.ambient = {0.1F, 0.05F, 0.2F};
  scene.material.phase_g = 0.3F;
  return scene;
}

// The image model's sums for one ray from the eye at (0, 0, 10), with nothing but loops.
struct BruteForce {
  const Scene& scene;
  glm::dvec3 eye{0.0, 0.0, 10.0};

  [[nodiscard]] glm::dvec3 Center(size_t i) const {
    return glm::dvec3(scene.particles->positions[i]) +
           scene.time_offset_s * glm::dvec3(scene.particles->velocities[i]);
  }
  // On the ray from `from` in direction d.
  [[nodiscard]] double OpticalDepth(size_t i, const glm::dvec3& from, const glm::dvec3& d) const {
    const double b = glm::length(glm::cross(Center(i) - from, d));
    const double rho = b / static_cast<double>(scene.particles->radii[i]);
    if (rho >= 1.0) return 0.0;
    const double tau = -std::log(1.0 - static_cast<double>(scene.particles->opacities[i]));
    return tau * (scene.material.profile == Profile::kSoft ? 1.0 - rho * rho
                                                           : std::sqrt(1.0 - rho * rho));
  }

  // `nearest_first` are the particles in the order of blending; `shadow(i, x)` the transmittances
  // of the scene's one light.
  template <typename Shadow>
  glm::dvec4 Blend(const glm::dvec3& d, const std::vector<size_t>& nearest_first,
                   const Shadow& shadow) const {
    const Light& light = scene.lights[0];
    glm::dvec4 sum(0.0);
    double clear = 1.0;
    for (const size_t i : nearest_first) {
      const glm::dvec3 x = eye + glm::dot(Center(i) - eye, d) * d;
      const auto* point = std::get_if<PointLight>(&light.kind);
      const glm::dvec3 travel = point != nullptr ? glm::normalize(x - point->position)
                                                 : std::get<DirectionalLight>(light.kind).direction;
      const double g = scene.material.phase_g;
      const double phase =
          (1.0 - g * g) / std::pow(1.0 + g * g + 2.0 * g * glm::dot(travel, d), 1.5);
      double falloff = 1.0;
      if (point != nullptr && point->inverse_square_falloff) {
        falloff = 1.0 / std::pow(glm::distance(x, point->position), 2.0);
      }
      const double alpha = 1.0 - std::exp(-OpticalDepth(i, eye, d));
      const glm::dvec3 color = glm::dvec3(scene.particles->colors[i]) *
                                   (glm::dvec3(scene.material.ambient) +
                                    glm::dvec3(light.color) * phase * falloff * shadow(i, x)) +
                               glm::dvec3(scene.particles->emissions[i]);
      sum += clear * alpha * glm::dvec4(color, 1.0);
      clear *= 1.0 - alpha;
    }
    return sum;
  }
};

// The direction through the middle of a pixel of EmptyScene's camera.
glm::dvec3 RayOf(const Scene& scene, const glm::ivec2& pixel) {
  const double size = scene.camera.width;
  const double slope = std::tan(std::get<Perspective>(scene.camera.projection).vertical_fov / 2.0);
  return glm::normalize(glm::dvec3((2.0 * (pixel.x + 0.5) / size - 1.0) * slope,
                                   (1.0 - 2.0 * (pixel.y + 0.5) / size) * slope, -1.0));
}

std::vector<size_t> Sorted(size_t count, const std::function<double(size_t)>& key) {
  std::vector<size_t> order(count);
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&key](size_t a, size_t b) { return key(a) < key(b); });
  return order;
}

void ExpectNear(const glm::dvec4& value, const glm::dvec4& expected, double tolerance = 1e-12) {
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(value[i], expected[i], tolerance) << "channel " << i;
}

TEST(Oracle, OneParticleIsTheClosedForm) {
  for (const Profile profile : {Profile::kSoft, Profile::kBall}) {
    Scene scene = SceneOf({{0.3F, -0.2F, 0.0F}});
    scene.material.profile = profile;
    const OracleImage image = RenderUnshadowed(scene);
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      const glm::dvec3 d = RayOf(scene, image.pixels[i]);
      const glm::dvec3 offset(0.3F, -0.2F, -10.0);
      const double rho = std::min(1.0, glm::length(glm::cross(offset, d)));
      const double w = profile == Profile::kSoft ? 1.0 - rho * rho : std::sqrt(1.0 - rho * rho);
      EXPECT_NEAR(image.rgba[i].a, 1.0 - std::pow(0.5, w), 1e-12);
      if (rho < 1.0) {
        EXPECT_NEAR(image.depth[i], glm::dot(offset, d) * -d.z, 1e-12);
      } else {
        EXPECT_EQ(image.depth[i], std::numeric_limits<double>::infinity());
      }
    }
  }
}

TEST(Oracle, CoaxialParticlesMultiplyTheirTransparency) {
  for (const bool flat : {false, true}) {
    Scene scene = SceneOf(std::vector<glm::vec3>(7, glm::vec3(0.0F)));
    if (flat) scene.camera.projection = Orthographic{3.0};
    scene.material.opacity = 0.18F;
    const double expected = 1.0 - std::pow(1.0 - 0.18F, 7);
    EXPECT_NEAR(MiddlePixel(RenderUnshadowed(scene)).a, expected, 1e-12);
    EXPECT_NEAR(MiddlePixel(RenderHalfAngle(scene)).a, expected, 1e-12);
  }
}

TEST(Oracle, RowZeroIsTheTopAndXIsToTheRight) {
  Scene scene = SceneOf({{1.2F, 1.2F, 0.0F}});
  scene.material.radius = 0.3F;
  const OracleImage image = RenderUnshadowed(scene);
  const auto largest = std::max_element(image.rgba.begin(), image.rgba.end(),
                                        [](const auto& a, const auto& b) { return a.a < b.a; });
  const glm::ivec2 pixel = image.pixels[static_cast<size_t>(largest - image.rgba.begin())];
  EXPECT_GT(pixel.x, 16);
  EXPECT_LT(pixel.y, 16);
}

TEST(Oracle, TwoParticlesShadeEachOtherAsByHand) {
  // The light comes from the eye's side: the nearer particle shades the farther one.
  Scene scene = SceneOf({{0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, -1.0F}});
  Light light;
  light.kind = DirectionalLight{{0.0, 0.0, -1.0}};
  light.shadow_density = {1.0F, 2.0F, 0.0F};
  scene.lights = {light};
  scene.shadow.slices = 2;
  // 0.5 of the near one's light, then a quarter of what reaches the far one.
  const glm::dvec4 expected(0.5 + 0.25 * 0.5, 0.5 + 0.25 * 0.25, 0.5 + 0.25, 0.75);
  ExpectNear(MiddlePixel(RenderExact(scene)), expected);
  ExpectNear(MiddlePixel(RenderHalfAngle(scene)), expected);
  // In one slice, interpolated: the second sees all of the slice but itself, the first nothing.
  scene.shadow.slices = 1;
  ExpectNear(MiddlePixel(RenderHalfAngle(scene)), expected);
  // Plain: nothing lies in earlier slices.
  scene.shadow.interpolate = false;
  ExpectNear(MiddlePixel(RenderHalfAngle(scene)), glm::dvec4(0.75));
}

TEST(Oracle, ExactModelEqualsBruteForce) {
  Scene scene = RandomScene(60, 15);
  scene.time_offset_s = 0.5;
  Light light;
  light.color = {1.0F, 2.0F, 3.0F};
  light.shadow_density = {1.0F, 0.5F, 2.0F};
  for (const bool point : {false, true}) {
    const glm::dvec3 direction = glm::normalize(glm::dvec3(0.5, -1.0, 0.2));
    const glm::dvec3 position(0.2, 0.4, -0.3);  // among the particles
    if (point) {
      light.kind = PointLight{position, true};
    } else {
      light.kind = DirectionalLight{direction};
    }
    scene.lights = {light};
    const BruteForce brute{scene};
    const size_t count = scene.particles->size();
    const auto depth = [&](size_t i) {
      return point ? glm::distance(brute.Center(i), position)
                   : glm::dot(brute.Center(i), direction);
    };
    const OracleImage image = RenderExact(scene);
    for (size_t p = 0; p < image.pixels.size(); ++p) {
      const glm::dvec3 d = RayOf(scene, image.pixels[p]);
      const auto order =
          Sorted(count, [&](size_t i) { return glm::dot(brute.Center(i) - brute.eye, d); });
      const glm::dvec4 expected = brute.Blend(d, order, [&](size_t i, const glm::dvec3& x) {
        const glm::dvec3 ray = point ? glm::normalize(x - position) : direction;
        double sum = 0.0;
        for (size_t j = 0; j < count; ++j) {
          if (j == i || depth(j) >= depth(i)) continue;
          if (point && glm::dot(brute.Center(j) - position, ray) <= 0.0) continue;
          sum += brute.OpticalDepth(j, x, ray);
        }
        return glm::exp(-glm::dvec3(light.shadow_density) * sum);
      });
      ExpectNear(image.rgba[p], expected, 1e-9);
    }
  }
}

struct HalfAngleCase {
  const char* name;
  glm::dvec3 light_direction;
  Profile profile;
};

class OracleHalfAngle : public testing::TestWithParam<HalfAngleCase> {};

TEST_P(OracleHalfAngle, OneParticleASliceEqualsBruteForce) {
  Scene scene = RandomScene(60, 15);
  scene.material.profile = GetParam().profile;
  Light light;
  light.kind = DirectionalLight{glm::normalize(GetParam().light_direction)};
  light.shadow_density = {1.0F, 0.5F, 2.0F};
  scene.lights = {light};
  const size_t count = scene.particles->size();
  scene.shadow.slices = static_cast<int>(count);

  const BruteForce brute{scene};
  const glm::dvec3 l = glm::normalize(GetParam().light_direction);
  const glm::dvec3 v(0.0, 0.0, -1.0);
  const bool under = glm::dot(v, l) > 0.0;
  const glm::dvec3 h = glm::normalize(under ? v + l : l - v);
  const auto along = Sorted(count, [&](size_t i) { return glm::dot(brute.Center(i), h); });
  std::vector<size_t> nearest_first = along;
  if (!under) std::reverse(nearest_first.begin(), nearest_first.end());

  const OracleImage image = RenderHalfAngle(scene);
  for (size_t p = 0; p < image.pixels.size(); ++p) {
    const glm::dvec3 d = RayOf(scene, image.pixels[p]);
    const glm::dvec4 expected = brute.Blend(d, nearest_first, [&](size_t i, const glm::dvec3& x) {
      double sum = 0.0;
      for (const size_t j : along) {
        if (j == i) break;
        sum += brute.OpticalDepth(j, x, l);
      }
      return glm::exp(-glm::dvec3(light.shadow_density) * sum);
    });
    ExpectNear(image.rgba[p], expected, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(BothFlips, OracleHalfAngle,
                         testing::Values(HalfAngleCase{"Parallel", {0, 0, -1}, Profile::kSoft},
                                         HalfAngleCase{"Beside", {1, -0.5, -0.5}, Profile::kBall},
                                         HalfAngleCase{"Perpendicular", {0, -1, 0}, Profile::kSoft},
                                         HalfAngleCase{"Behind", {0.3, -0.5, 0.8}, Profile::kSoft},
                                         HalfAngleCase{"Antiparallel", {0, 0, 1}, Profile::kBall}),
                         [](const auto& instance) { return instance.param.name; });

TEST(Oracle, FewSlicesSplitWhatManyOrder) {
  // 10 in 4 slices: 2, 3, 2, 3, as floor(s N / S) has it.
  std::vector<glm::vec3> positions(10, glm::vec3(0.0F));
  for (size_t i = 0; i < positions.size(); ++i) positions[i].z = -static_cast<float>(i);
  const Scene scene = SceneOf(positions);
  const HalfAngleOrder order = OrderByHalfAngle(ResolveCloud(scene), Rays::Along({0.0, 0.0, -1.0}),
                                                {0.0, 0.0, -1.0}, {.slices = 4});
  std::vector<uint32_t> begins;
  for (const SlicePlace& place : order.places) begins.push_back(place.begin);
  EXPECT_EQ(begins, (std::vector<uint32_t>{0, 0, 2, 2, 2, 5, 5, 7, 7, 7}));
  EXPECT_EQ(order.places[3].fraction, 0.5);
  EXPECT_EQ(order.places[4].fraction, 1.0);
}

TEST(Oracle, EqualOpticalDepthWeighsParticles) {
  Scene scene = SceneOf({{0, 0, 0}, {0, 0, -1}, {0, 0, -2}, {0, 0, -3}});
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->radii = {1.0F, 1.0F, 1.0F, 3.0F};  // the last weighs 9 of 12
  scene.particles = set;
  const HalfAngleOrder order =
      OrderByHalfAngle(ResolveCloud(scene), Rays::Along({0.0, 0.0, -1.0}), {0.0, 0.0, -1.0},
                       {.slices = 2, .spacing = SliceSpacing::kEqualOpticalDepth});
  EXPECT_EQ(order.places[2].end, 3U);
  EXPECT_EQ(order.places[3].begin, 3U);
}

TEST(Oracle, DensityZeroIsUnshadowedAndFurtherLightsAddUp) {
  Scene scene = RandomScene(40, 15);
  Light shaded;
  shaded.kind = DirectionalLight{glm::normalize(glm::dvec3(1.0, -1.0, -1.0))};
  Light open = shaded;
  open.shadow_density = glm::vec3(0.0F);
  Light lamp;
  lamp.kind = PointLight{{0.0, 3.0, 1.0}, true};

  scene.material.ambient = glm::vec3(0.0F);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->emissions.clear();
  scene.particles = set;
  const auto render = [&](std::vector<Light> lights) {
    scene.lights = std::move(lights);
    return RenderHalfAngle(scene);
  };
  const OracleImage first = render({shaded});
  const OracleImage second = render({lamp});
  const OracleImage both = render({shaded, lamp});
  for (size_t i = 0; i < both.rgba.size(); ++i) {
    const glm::dvec3 sum = glm::dvec3(first.rgba[i]) + glm::dvec3(second.rgba[i]);
    ExpectNear(both.rgba[i], glm::dvec4(sum, first.rgba[i].a), 1e-9);
  }
  const OracleImage unlit = render({open});
  EXPECT_EQ(unlit.transmittance.front(), glm::dvec3(1.0));
  const OracleImage unshadowed = RenderUnshadowed(scene);
  EXPECT_LT(CompareColor(unlit, unshadowed).rmse, 0.02);  // only the order differs
}

TEST(Oracle, AWindowIsPartOfTheWholeAndAStrideASubset) {
  Scene scene = RandomScene(40, 21);
  const OracleImage whole = RenderUnshadowed(scene);
  scene.camera.window = {5, 3, 10, 12};
  const OracleImage part = RenderUnshadowed(scene, {.stride = 2});
  ASSERT_EQ(part.pixels.size(), 30U);
  for (size_t i = 0; i < part.pixels.size(); ++i) {
    const glm::ivec2 place = part.pixels[i] + glm::ivec2(5, 3);
    EXPECT_EQ(part.rgba[i], whole.rgba[static_cast<size_t>(place.y * 21 + place.x)]);
  }
}

TEST(Oracle, FarFromTheWorldsOriginNothingChanges) {
  Scene scene = RandomScene(40, 15);
  Light light;
  light.kind = PointLight{{0.5, 3.0, 1.0}, false};
  scene.lights = {light};
  const OracleImage here = RenderHalfAngle(scene);
  const glm::dvec3 far(1e7, -2e7, 3e7);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->origin = far;
  scene.particles = set;
  scene.camera.view_from_world = glm::translate(scene.camera.view_from_world, -far);
  std::get<PointLight>(scene.lights[0].kind).position += far;
  const OracleImage there = RenderHalfAngle(scene);
  EXPECT_LT(CompareColor(there, here).max, 1e-6);
}

TEST(Oracle, PlumeDarkensWhereTheModelSaysItDoes) {
  Scene scene;
  scene.particles = LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  ASSERT_NE(scene.particles, nullptr);
  ASSERT_EQ(scene.particles->size(), 56'000U);
  scene.material.radius = 0.045F;
  scene.camera.view_from_world =
      glm::lookAt(glm::dvec3(0.5, 1.5, 4.6), glm::dvec3(0, 1.25, 0), glm::dvec3(0, 1, 0));
  scene.camera.width = scene.camera.height = 240;
  scene.camera.window = {0, 0, 240, 240};
  Light light;
  light.kind = DirectionalLight{glm::normalize(glm::dvec3(-1.0, -1.0, -0.4))};
  scene.lights = {light};
  const OracleOptions few{.stride = 8};
  const OracleImage exact = RenderExact(scene, few);
  const double plain_error = [&] {
    scene.shadow.interpolate = false;
    return CompareColor(RenderHalfAngle(scene, few), exact).relative_rmse;
  }();
  scene.shadow.interpolate = true;
  const ImageError interpolated = CompareColor(RenderHalfAngle(scene, few), exact);
  // DESIGN's table: 31 % and 11 % about 50 degrees from the view, 47 % and 16 % about 75.
  EXPECT_GT(plain_error, 0.2);
  EXPECT_LT(plain_error, 0.6);
  EXPECT_GT(interpolated.relative_rmse, 0.05);
  EXPECT_LT(interpolated.relative_rmse, 0.25);
  EXPECT_EQ(interpolated.pixels, 900U);
}

}  // namespace
}  // namespace halflight::oracle
