// What an engine builds before the first request: all that common frames need, without being in
// anybody's way.
#include "renderer/warm_up.h"

#include <future>
#include <string>

#include <gtest/gtest.h>

#include "renderer/render_thread.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

class WarmUp : public test::GlTest {};

TEST_F(WarmUp, BuildsEveryProgramThatCommonFramesNeed) {
  for (const FrameRequest& frame : WarmUpFrames()) Render(frame);
  const size_t built = Renderer().programs_built();
  EXPECT_GT(built, 4U);

  const auto expect_nothing_built = [&](const char* what, const Scene& scene) {
    Render({scene, {{ImageKind::kBeauty}, {ImageKind::kCoverage}}});
    EXPECT_EQ(Renderer().programs_built(), built) << what;
  };
  Scene scene = test::BallScene(100);
  expect_nothing_built("from the front", scene);
  scene.lights = {test::Sun({1, -1, 2})};
  expect_nothing_built("from behind", scene);
  scene.lights.push_back(test::Sun({-1, -1, 0.2}));
  expect_nothing_built("two lights", scene);
  scene.lights.resize(1);
  scene.lights[0].shadow_density = {0.2F, 0.4F, 0.8F};
  expect_nothing_built("coloured shadows", scene);

  scene = test::BallScene(100);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->radii.assign(set->size(), 0.05F);
  set->opacities.assign(set->size(), 0.3F);
  set->colors.assign(set->size(), glm::vec3(0.5F));
  scene.particles = set;
  expect_nothing_built("attributes of their own", scene);

  // And what nothing says beforehand is built when it comes.
  scene.material.profile = Profile::kBall;
  scene.material.phase_g = 0.4F;
  scene.lights[0].kind = PointLight{{3, 3, 3}, true};
  Render(test::Beauty(scene));
  EXPECT_GT(Renderer().programs_built(), built);
}

TEST(WarmEngine, RendersWhatAnotherDoesAtWhateverTime) {
  const FrameRequest request = test::Beauty(test::BallScene(500));
  std::vector<std::vector<float>> pixels;
  for (const bool warm_up : {false, true}) {
    auto engine = StartRenderThread({.renderer = {}, .warm_up = warm_up});
    ASSERT_TRUE(engine.ok()) << engine.status();
    // At once, while it warms up, and another as soon as that one is done.
    for (int frame = 0; frame < 2; ++frame) {
      std::promise<std::vector<float>> done;
      ASSERT_TRUE((*engine)
                      ->Submit(request, {},
                               [&done](absl::StatusOr<FrameResult> result) {
                                 EXPECT_TRUE(result.ok()) << result.status();
                                 done.set_value(result.ok() ? result->images[0].pixels
                                                            : std::vector<float>{});
                               })
                      .ok());
      pixels.push_back(done.get_future().get());
    }
  }
  for (const std::vector<float>& frame : pixels) EXPECT_EQ(frame, pixels[0]);
}

}  // namespace
}  // namespace halflight
