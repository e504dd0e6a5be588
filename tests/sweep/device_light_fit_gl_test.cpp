// The light sweep on the device against that on the CPU and in float64, and against itself in other
// runs and tiles.
#include "renderer/sweep/device/light_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <string>

#include "tests/oracle/plume.h"
#include "tests/renderer/device_fixture.h"
#include "tests/renderer/test_scene.h"
#include "tests/sweep/fitted_light.h"

namespace halflight::sweep {
namespace {

class DeviceLightFitTest : public test::DeviceTest {
 protected:
  static absl::StatusOr<DeviceLightFit> FitOnDevice(const Scene& scene,
                                                    const LightSweepSettings& settings = {},
                                                    const std::stop_token& stop = {}) {
    const ParticleView particles(scene);
    return FitLightOnDevice(Device(), scene.lights[0], particles, UploadParticles(particles),
                            scene.material.profile, scene.shadow.light_buffer_size,
                            scene.shadow.fit_degree, stop, settings);
  }

  static std::vector<float> OpticalDepthOf(const DeviceLightFit& fit) {
    Image image;
    Readback readback(nullptr);
    ReadOpticalDepth(fit, readback, image);
    return image.pixels;
  }

  // Fails the test where the fit fails.
  static FittedLight OnDevice(const Scene& scene, const LightSweepSettings& settings = {}) {
    const absl::StatusOr<DeviceLightFit> fit = FitOnDevice(scene, settings);
    EXPECT_TRUE(fit.ok()) << fit.status();
    if (!fit.ok()) return {};
    const size_t count = scene.particles->size();
    const size_t terms = static_cast<size_t>(Terms(fit->degree));
    return {test::ReadBuffer<float>(fit->depth, count * terms),
            test::ReadBuffer<Sprite>(fit->sprites, count), OpticalDepthOf(*fit)};
  }

  static FitDifference Compare(const std::string& name, const Scene& scene,
                               const LightSweepSettings& settings = {}) {
    const FitDifference difference =
        Between(OnDevice(scene, settings), FitOnCpu(scene), scene.shadow.fit_degree);
    std::cout << name << ": rms " << difference.rms << ", largest " << difference.largest
              << ", behind " << difference.behind << "\n";
    return difference;
  }
};

Light PointAt(const glm::dvec3& position) {
  Light light;
  light.kind = PointLight{position, false};
  return light;
}

// Radii of one to three texels, opacities of 0.1 to 0.5.
Scene VariedBall(size_t count) {
  Scene scene = test::BallScene(count);
  test::VaryParticles(scene, 0.1F, 0.4F);
  return scene;
}

struct FitCase {
  const char* name;
  void (*change)(Scene&);
};

// Both round: where a texel lies against a sprite to some 1e-5 of the smallest sprites' radius,
// which tells most at the steep rim of a ball, and sums to their last digits. A fit of degree 6
// makes 20 times as much of it. Both are about as far from float64.
void ExpectRounding(const FitDifference& difference) {
  EXPECT_LT(difference.rms, 5e-6);
  EXPECT_LT(difference.largest, 1e-3);
  EXPECT_LT(difference.behind, 1e-4);
  EXPECT_LT(difference.sprites, 1e-6);
}

class DeviceLightFitOf : public DeviceLightFitTest, public testing::WithParamInterface<FitCase> {};

TEST_P(DeviceLightFitOf, IsTheCpusAtEveryDegree) {
  Scene scene = VariedBall(1500);
  GetParam().change(scene);
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    scene.shadow.fit_degree = degree;
    ExpectRounding(Compare(GetParam().name + (", degree " + std::to_string(degree)), scene));
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, DeviceLightFitOf,
                         testing::Values(FitCase{"Sun", [](Scene&) {}},
                                         FitCase{"PointAndBalls",
                                                 [](Scene& s) {
                                                   s.lights = {PointAt({-1.0, 1.2, 0.7})};
                                                   s.material.profile = Profile::kBall;
                                                 }}),
                         [](const auto& instance) { return std::string(instance.param.name); });

class DeviceLightFitFor : public DeviceLightFitTest, public testing::WithParamInterface<FitCase> {};

TEST_P(DeviceLightFitFor, IsTheCpus) {
  Scene scene = VariedBall(1500);
  GetParam().change(scene);
  ExpectRounding(Compare(GetParam().name, scene));
}

void SetRadii(Scene& scene, float (*radius)(size_t)) {
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->radii.clear();
  for (size_t i = 0; i < set->size(); ++i) set->radii.push_back(radius(i));
  scene.particles = set;
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, DeviceLightFitFor,
    testing::Values(FitCase{"SunAndBalls", [](Scene& s) { s.material.profile = Profile::kBall; }},
                    FitCase{"Point",
                            [](Scene& s) {
                              s.lights = {PointAt({1.5, 2.0, 1.0})};
                            }},
                    FitCase{"Plume",
                            [](Scene& s) {
                              s.particles = oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) +
                                                              "/plume/plume.0040.ply");
                              s.material.radius = 0.045F;
                              s.shadow.light_buffer_size = 150;
                            }},
                    FitCase{"OneParticle", [](Scene& s) { s.particles = test::Ball(1); }},
                    FitCase{"ParticlesBelowATexel",
                            [](Scene& s) { SetRadii(s, [](size_t) { return 1e-4F; }); }},
                    FitCase{"ParticlesOverTheWholeBuffer",
                            [](Scene& s) {
                              SetRadii(s, [](size_t i) { return i % 300 == 7 ? 1.5F : 0.05F; });
                            }},
                    FitCase{"RadiiOfAllSizes",
                            [](Scene& s) {
                              SetRadii(s, [](size_t i) {
                                return std::pow(10.0F, -5.0F * static_cast<float>(i % 97) / 96.0F);
                              });
                            }},
                    FitCase{"DeepCloud",
                            [](Scene& s) {
                              SetRadii(s, [](size_t) { return 0.4F; });
                              auto set = std::make_shared<ParticleSet>(*s.particles);
                              set->opacities.assign(set->size(), 0.9999F);
                              s.particles = set;
                            }}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST_F(DeviceLightFitTest, IsAsNearFloat64AsTheCpus) {
  for (const Profile profile : {Profile::kSoft, Profile::kBall}) {
    for (const float radius : {0.03F, 0.4F}) {
      Scene scene = test::BallScene(1000);
      scene.material.profile = profile;
      scene.material.radius = radius;
      scene.material.opacity = 0.9F;
      const FittedLight exact = FitInFloat64(scene);
      const FitDifference device = Between(OnDevice(scene), exact, scene.shadow.fit_degree);
      const FitDifference cpu = Between(FitOnCpu(scene), exact, scene.shadow.fit_degree);
      std::cout << "radius " << radius << ": device " << device.rms << ", CPU " << cpu.rms << "\n";
      EXPECT_LT(device.rms, 2.0 * cpu.rms) << radius;
      EXPECT_LT(device.behind, 3.0 * cpu.behind) << radius;
    }
  }
}

// All in one tile, more than llvmpipe's loops could walk one by one.
TEST_F(DeviceLightFitTest, IsTheCpusWhereTileListsAreLong) {
  Scene scene = test::BallScene(100'000);
  scene.material.radius = 0.1F;
  scene.material.opacity = 1e-3F;
  scene.shadow.light_buffer_size = 16;
  scene.shadow.fit_degree = 1;
  ExpectRounding(Compare("long tile lists", scene, {.limits = {}, .light_tile = 16}));
}

TEST_F(DeviceLightFitTest, IsTheSameInRunsOfAnyLength) {
  Scene scene = VariedBall(1500);
  SetRadii(scene, [](size_t i) { return i % 300 == 7 ? 1.5F : 0.05F; });
  const FittedLight whole = OnDevice(scene);
  // Cut by places; by texels between groups; by texels within groups, some particles alone too
  // many.
  for (const PatchRunLimits& limits :
       {PatchRunLimits{.places = 300}, PatchRunLimits{.places = 77},
        PatchRunLimits{.texels = 40'000}, PatchRunLimits{.texels = 2'000}, kLongRuns}) {
    EXPECT_TRUE(OnDevice(scene, {.limits = limits}) == whole)
        << limits.texels << " texels, " << limits.places << " places";
  }
}

TEST(LightSweepSettings, TakeLongRunsWhereLoopsEndWhenTheyShould) {
  DeviceInfo device;
  device.software = true;
  EXPECT_EQ(LightSweepSettingsFor(device).limits.places, PatchRunLimits{}.places);
  device.software = false;
  EXPECT_EQ(LightSweepSettingsFor(device).limits.places, kLongRuns.places);
}

TEST_F(DeviceLightFitTest, IsTheSameWithTilesOfAnySize) {
  const Scene scene = VariedBall(1500);
  EXPECT_TRUE(OnDevice(scene, {.limits = {}, .light_tile = 16}) ==
              OnDevice(scene, {.limits = {}, .light_tile = 8}));
}

TEST_F(DeviceLightFitTest, IsTheSameAgain) {
  const Scene scene = VariedBall(1500);
  EXPECT_TRUE(OnDevice(scene) == OnDevice(scene));
}

TEST_F(DeviceLightFitTest, OfNoParticlesIsEmpty) {
  Scene scene = test::BallScene(0);
  const FittedLight none = OnDevice(scene);
  EXPECT_TRUE(none.depth.empty());
  const auto texels = static_cast<size_t>(scene.shadow.light_buffer_size);
  EXPECT_EQ(none.behind, std::vector<float>(texels * texels, 0.0F));
}

TEST_F(DeviceLightFitTest, EndsWhenItIsStopped) {
  std::stop_source stop;
  stop.request_stop();
  const auto fit = FitOnDevice(VariedBall(100), {}, stop.get_token());
  EXPECT_EQ(fit.status().code(), absl::StatusCode::kCancelled) << fit.status();
}

// One particle all over the light buffer: its patch is too large, or the light buffer itself.
TEST_F(DeviceLightFitTest, RefusesWhatItsBuffersCannotHold) {
  Scene scene = test::BallScene(1);
  for (const int size : {5000, 8192}) {
    scene.shadow.light_buffer_size = size;
    for (const PatchRunLimits& limits : {PatchRunLimits{}, kLongRuns}) {
      const auto fit = FitOnDevice(scene, {.limits = limits});
      EXPECT_EQ(fit.status().code(), absl::StatusCode::kResourceExhausted) << fit.status();
      EXPECT_THAT(fit.status().message(), testing::HasSubstr("allowed on this device")) << size;
    }
  }
}

}  // namespace
}  // namespace halflight::sweep
