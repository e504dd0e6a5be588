// The particle shadow map against the reference, by bins and degree: docs/image-model.md has the
// figures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "renderer/error_map.h"
#include "tests/oracle/plume.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using ::testing::HasSubstr;

class ParticleShadowMap : public test::GlTest {
 protected:
  static Scene PlumeScene(int bins, int degree) {
    static const std::shared_ptr<ParticleSet> plume =
        oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
    Scene scene;
    scene.particles = plume;
    scene.camera = test::LookAt({0.5, 1.5, 4.6}, {0, 1.25, 0}, 120, 120);
    scene.lights = {test::Sun({1, -0.6, -0.4})};
    scene.material.radius = 0.045F;
    scene.shadow.technique = ShadowTechniqueKind::kParticleShadowMap;
    scene.shadow.light_buffer_size = 256;
    scene.shadow.slices = bins;
    scene.shadow.fit_degree = degree;
    return scene;
  }

  static double RelativeRmse(const Scene& scene) {
    const Image beauty = RenderBeauty(scene);
    const auto map = ErrorMap(beauty, scene);
    EXPECT_TRUE(map.ok()) << map.status();
    return map.ok() ? ErrorOf(beauty, *map).relative_rmse.value : 1.0;
  }
};

TEST_F(ParticleShadowMap, ErrsLessWithMoreBinsAndHigherDegrees) {
  struct Bound {
    int bins;
    int degree;
    double most;
  };
  double last = 1.0;
  for (const Bound& bound :
       {Bound{32, 3, 0.14}, {64, 3, 0.07}, {128, 3, 0.04}, {1024, 3, 0.025}, {1024, 4, 0.016}}) {
    const double error = RelativeRmse(PlumeScene(bound.bins, bound.degree));
    std::cout << bound.bins << " bins, degree " << bound.degree << ": relative RMSE " << error
              << "\n";
    EXPECT_LT(error, bound.most) << bound.bins;
    EXPECT_LT(error, last) << bound.bins;
    last = error;
  }
}

// Bins so thin that a particle has its own.
TEST_F(ParticleShadowMap, OfThinBinsIsTheLightSweep) {
  Scene scene = PlumeScene(8192, 4);
  const Image bins = RenderBeauty(scene);
  scene.shadow.technique = ShadowTechniqueKind::kLightSweep;
  EXPECT_LT(test::MaxDifference(bins, RenderBeauty(scene)), 0.02);
  scene.shadow.technique = ShadowTechniqueKind::kParticleShadowMap;
  scene.shadow.slices = 64;
  scene.shadow.light_buffer_size = 256;
  EXPECT_GT(test::MaxDifference(bins, RenderBeauty(scene)), 0.1);
}

// In one bin, half way through it: half of the light's other particles, its own left out.
TEST_F(ParticleShadowMap, OfOneBinSeesOthersByItsPlaceAndNotItself) {
  Scene scene = PlumeScene(1, 0);
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{0, 0, -1}, {0, 0, 0}, {0, 0, 1}};
  scene.particles = set;
  scene.lights = {test::Sun({0, 0, 1})};
  scene.camera = test::LookAt({0, 4, 0}, {0, 0, 0}, 65, 65);
  scene.material.radius = 0.3F;
  const auto middle = [&] {
    const FrameResult frame =
        Render({scene,
                {{ImageKind::kLightTransmittance, 0},
                 {ImageKind::kLightBuffer, 0, LightQuantity::kOpticalDepth}}});
    return *test::PixelAt(frame.images[0], 32, 32);
  };
  // Three particles and no more bins than that: the middle of one bin, with two others in it.
  const double one_bin = -std::log(static_cast<double>(middle()));
  scene.shadow.technique = ShadowTechniqueKind::kLightSweep;
  const double before = -std::log(static_cast<double>(middle()));
  EXPECT_NEAR(one_bin, before, 1e-4);
}

TEST_F(ParticleShadowMap, WithPointLightsAndSeveralLightsIsNearTheModel) {
  Scene scene = PlumeScene(256, 4);
  scene.lights.push_back(test::Sun({-1, -0.2, 0.3}, 0.5F));
  Light point;
  point.kind = PointLight{{1.5, 3, 1.2}, false};
  scene.lights.push_back(point);
  scene.lights.back().shadow_density = {0.5F, 1.0F, 2.0F};
  const double error = RelativeRmse(scene);
  std::cout << "three lights: relative RMSE " << error << "\n";
  EXPECT_LT(error, 0.03);
}

TEST_F(ParticleShadowMap, RefusesALightAmongTheParticles) {
  FrameRequest request = test::Beauty(PlumeScene(64, 4));
  request.scene.lights[0].kind = PointLight{{0, 1, 0}, false};
  const auto frame = Renderer().Render(request, {});
  ASSERT_FALSE(frame.ok());
  EXPECT_THAT(frame.status().message(),
              HasSubstr("lighting.lights[0].point.position: (0, 1, 0), allowed under technique "
                        "PARTICLE_SHADOW_MAP: "));
}

TEST_F(ParticleShadowMap, RepeatsItselfAndStopsWhenToldTo) {
  FrameRequest request = test::Beauty(PlumeScene(64, 3));
  request.reuse = false;
  EXPECT_EQ(Render(request).images.at(0).pixels, Render(request).images.at(0).pixels);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(absl::IsCancelled(Renderer().Render(request, stop.get_token()).status()));
}

}  // namespace
}  // namespace halflight
