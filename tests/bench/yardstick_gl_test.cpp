// The yardstick draws the right picture: the model's coverage, and the light sweep's of degree 0.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "renderer/frame_renderer.h"
#include "tests/bench/yardstick.h"
#include "tests/measure/frame_error.h"
#include "tests/measure/plume_scene.h"
#include "tests/oracle/image_error.h"
#include "tests/renderer/gl_fixture.h"
#include "tests/renderer/test_scene.h"

namespace halflight::bench {
namespace {

// The frame of the benchmark at half its size along each side.
Scene Plume() {
  const auto plume = measure::LoadPlumeFrame(HALFLIGHT_TEST_DATA, "0040");
  EXPECT_TRUE(plume.ok()) << plume.status();
  Scene scene = measure::PlumeScene(
      measure::Replicate(**plume, 65'536, measure::kPlumeOpacity, measure::kPlumeJitter),
      measure::kSideLight, 320, 256);
  scene.shadow.technique = ShadowTechniqueKind::kLightSweep;
  scene.shadow.fit_degree = 0;
  scene.shadow.light_buffer_size = 256;
  return scene;
}

class YardstickPicture : public test::GlTest {
 protected:
  void SetUp() override {
    if (!Yardstick::Runs()) GTEST_SKIP() << "needs a CPU with AVX2 and FMA";
  }

  Image Drawn(const Scene& scene) {
    absl::StatusOr<FrameResult> frame = yardstick_.Draw(test::Beauty(scene));
    EXPECT_TRUE(frame.ok()) << frame.status();
    return frame.ok() ? std::move(frame->images[0]) : Image{};
  }

  Yardstick yardstick_;
};

TEST_F(YardstickPicture, ErrsAsOneShadowValueAParticleDoesAndCoversAsTheModel) {
  const Scene scene = Plume();
  const Image image = Drawn(scene);
  const measure::CoveredReference reference = measure::EvaluateCovered(scene);
  const double error = measure::CompareAll(image, reference).rmse;
  EXPECT_GT(error, 0.16);
  EXPECT_LT(error, 0.23);
  EXPECT_LT(oracle::CompareCoverage(image, reference.pixels).max, 1e-3);
}

// What of the sweep's picture the yardstick's differs by, relative to its mean: none of the fit's
// error is in it.
double DifferenceOf(const Image& image, const Image& swept) {
  double squares = 0.0;
  double sum = 0.0;
  for (size_t i = 0; i < swept.pixels.size(); ++i) {
    const double difference = image.pixels[i] - swept.pixels[i];
    squares += difference * difference;
    sum += swept.pixels[i];
  }
  const auto count = static_cast<double>(swept.pixels.size());
  return std::sqrt(squares / count) / (sum / count);
}

struct Variation {
  const char* name;
  void (*change)(Scene&);
};

class YardstickOf : public YardstickPicture, public testing::WithParamInterface<Variation> {};

TEST_P(YardstickOf, IsTheLightSweepOfDegreeZero) {
  Scene scene = Plume();
  GetParam().change(scene);
  EXPECT_LT(DifferenceOf(Drawn(scene), RenderBeauty(scene)), 0.01);
}

INSTANTIATE_TEST_SUITE_P(
    All, YardstickOf,
    testing::Values(
        Variation{"side_light", [](Scene&) {}},
        Variation{"back_light",
                  [](Scene& s) {
                    s.lights = {test::Sun({0.3, -0.4, 1})};
                  }},
        Variation{"light_from_straight_above",
                  [](Scene& s) {
                    s.lights = {test::Sun({0, -1, 0})};
                  }},
        Variation{"another_side", [](Scene& s) { s.camera = measure::PlumeCamera(320, 256, 130); }},
        Variation{"size_of_no_whole_tiles",
                  [](Scene& s) { s.camera = measure::PlumeCamera(203, 101); }},
        Variation{"colours",
                  [](Scene& s) {
                    s.material.albedo = {0.9F, 0.5F, 0.2F};
                    s.material.ambient = {0.0F, 0.1F, 0.3F};
                    s.material.emission = {0.1F, 0.0F, 0.0F};
                    s.lights[0].color = {1.0F, 2.0F, 3.0F};
                    s.lights[0].shadow_density = glm::vec3(0.4F);
                  }},
        Variation{"cut_off_by_the_frame",
                  [](Scene& s) {
                    s.camera = test::LookAt({0.2, 1.4, 2.0}, {0.6, 1.6, 0}, 160, 96);
                  }},
        Variation{"far_origin",
                  [](Scene& s) {
                    auto set = std::make_shared<ParticleSet>(*s.particles);
                    set->origin = {1e6, 0, 0};
                    s.particles = set;
                    s.camera = test::LookAt({1e6 + 0.5, 1.5, 4.6}, {1e6, 1.25, 0}, 320, 256);
                  }},
        Variation{"one_particle",
                  [](Scene& s) {
                    auto set = std::make_shared<ParticleSet>();
                    set->positions = {{0.0F, 1.25F, 0.0F}};
                    s.particles = set;
                    s.material.radius = 0.4F;
                  }}),
    [](const auto& of) { return std::string(of.param.name); });

TEST_F(YardstickPicture, IsTheSameEachTime) {
  const Scene scene = Plume();
  const Image first = Drawn(scene);
  EXPECT_EQ(Drawn(scene).pixels, first.pixels);
}

TEST_F(YardstickPicture, HasAllItsStagesTimed) {
  const absl::StatusOr<FrameResult> frame = yardstick_.Draw(test::Beauty(Plume()));
  ASSERT_TRUE(frame.ok());
  std::vector<std::string> stages;
  for (const StageTiming& timing : frame->timings) stages.push_back(timing.stage);
  EXPECT_THAT(stages, testing::ElementsAre("project", "sort and clear", "light", "shade", "bin",
                                           "composite"));
}

TEST_F(YardstickPicture, RefusesWhatIsNotInItsClassAndNamesIt) {
  const std::vector<std::pair<const char*, std::function<void(Scene&)>>> cases = {
      {"lights", [](Scene& s) { s.lights.push_back(s.lights[0]); }},
      {"lights",
       [](Scene& s) {
         s.lights[0].kind = PointLight{{0, 9, 0}};
       }},
      {"material.profile", [](Scene& s) { s.material.profile = Profile::kBall; }},
      {"material.opacity", [](Scene& s) { s.material.opacity = 0.9F; }},
      {"material", [](Scene& s) { s.material.phase_g = 0.5F; }},
      {"camera", [](Scene& s) { s.camera.projection = Orthographic{3.0}; }},
      {"camera",
       [](Scene& s) {
         s.camera = test::LookAt({0, 1, 0}, {0, 1, -1}, 64, 64);
       }},
      {"particles",
       [](Scene& s) {
         auto set = std::make_shared<ParticleSet>(*s.particles);
         set->radii.resize(set->size(), 0.1F);
         s.particles = set;
       }},
      {"scene", [](Scene& s) { s.sampling.downsample = 2; }},
  };
  for (const auto& [field, change] : cases) {
    Scene scene = Plume();
    change(scene);
    const absl::Status status = yardstick_.Draw(test::Beauty(scene)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field;
    EXPECT_THAT(std::string(status.message()), testing::StartsWith(std::string(field) + ":"));
  }
}

}  // namespace
}  // namespace halflight::bench
