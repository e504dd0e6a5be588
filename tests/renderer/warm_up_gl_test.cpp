// What an engine builds before the first request: all that common frames need, without being in
// anybody's way.
#include "renderer/warm_up.h"

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "renderer/device_fault.h"
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

// What clients ask for ends a frame that nobody asked for, which is drawn when they are served.
TEST(WarmEngine, MakesRoomForRequestsAndTakesUpWhatItLeft) {
  const size_t frames = WarmUpFrames().size();
  // Of an engine that has drawn nothing.
  const uint64_t idle_objects = [] {
    auto idle = StartRenderThread({});
    return idle.ok() ? (*idle)->state().gl_objects : 0;
  }();
  // The first, then the client's, then all of them; the last tells that it was drawn.
  auto faults = PlannedFaults::Parse(absl::StrCat("late:1,innocent-reset:", frames + 2));
  ASSERT_TRUE(faults.ok()) << faults.status();
  auto engine = StartRenderThread({.max_queued_frames = 1,  // what warms up takes nobody's place
                                   .renderer = {.faults = std::make_shared<PlannedFaults>(*faults)},
                                   .warm_up = true});
  ASSERT_TRUE(engine.ok()) << engine.status();
  const auto wait_for = [&engine](const auto& what) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    while (!what((*engine)->state()) && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return what((*engine)->state());
  };
  ASSERT_TRUE(wait_for([&](const EngineState& state) { return state.gl_objects > idle_objects; }))
      << "no frame has begun";
  std::promise<absl::Status> done;
  ASSERT_TRUE((*engine)
                  ->Submit(test::Beauty(test::BallScene(50)), {},
                           [&done](const absl::StatusOr<FrameResult>& frame) {
                             done.set_value(frame.status());
                           })
                  .ok());
  const absl::Status drawn = done.get_future().get();
  EXPECT_TRUE(drawn.ok()) << drawn;
  EXPECT_TRUE(wait_for([](const EngineState& state) { return state.device_resets == 1; }))
      << "not all " << frames << " were drawn after it";
}

}  // namespace
}  // namespace halflight
