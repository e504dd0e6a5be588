// Several frames begun before the first is finished: the same bytes, the same order, and what
// becomes of one is nothing to the others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "renderer/readback.h"
#include "renderer/render_thread.h"
#include "tests/renderer/device_fixture.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

// A frame of a sequence, and what becomes of it.
struct Shot {
  std::string name;
  FrameRequest request;
  bool cancelled = false;  // before it is finished
};

Scene SceneOf(ShadowTechniqueKind technique, int size) {
  Scene scene = test::BallScene(400, size);
  scene.shadow.technique = technique;
  scene.shadow.slices = 6;
  scene.shadow.light_buffer_size = 64;
  return scene;
}

// Techniques, sizes, outputs, lights, samplings, bands and both places of the sweep in turn, frames
// that fail early and late, and frames that are cancelled.
std::vector<Shot> MixedSequence() {
  const auto slices = [](int size) { return SceneOf(ShadowTechniqueKind::kHalfAngle, size); };
  const auto sweep = [](int size) { return SceneOf(ShadowTechniqueKind::kLightSweep, size); };
  std::vector<Shot> shots;
  const auto add = [&shots](const char* name, const Scene& scene,
                            const std::vector<ImageRequest>& images = {{ImageKind::kBeauty}}) {
    shots.push_back({name, {scene, images}});
    return &shots.back();
  };

  add("slices", slices(96));
  add("smaller", slices(40));
  add("sweep on the CPU", sweep(70));
  add("sweep on the device", sweep(64))->request.sweep_on = SweepOn::kDevice;
  add("cancelled", slices(96))->cancelled = true;
  Scene scene = slices(90);
  scene.lights.push_back(test::Sun({-1, -0.3, 1}));
  scene.lights.back().shadow_density = {0.5F, 1.0F, 2.0F};
  const std::vector<ImageRequest> all = {{ImageKind::kBeauty},
                                         {ImageKind::kCoverage},
                                         {ImageKind::kDepth},
                                         {ImageKind::kLightTransmittance, 1},
                                         {ImageKind::kLightBuffer, 1, LightQuantity::kOpticalDepth},
                                         {ImageKind::kLightLayers, 0},
                                         {ImageKind::kBeauty}};
  add("two lights, every output", scene, all);
  scene.camera = test::LookAt({1, 0.5, 3.8}, {0, 0, 0}, 200, 150);
  scene.sampling.supersample = 2;
  add("in bands of samples", scene, all);
  scene.material.scattering_spread = 0.1F;
  scene.sampling = {.downsample = 2};
  add("scattering", scene, all);
  scene = slices(64);
  scene.lights[0].kind = PointLight{{0, 0, 0}, false};
  add("refused", scene);
  add("reference", SceneOf(ShadowTechniqueKind::kReference, 8));
  scene = sweep(64);
  scene.shadow.light_buffer_size = 32768;  // beyond a storage block
  add("failing on the device", scene)->request.sweep_on = SweepOn::kDevice;
  scene = sweep(80);
  scene.lights.push_back(test::Sun({0, -1, 0.2}));
  Shot* const shown = add("sweep on the device, outputs", scene,
                          {{ImageKind::kDepth},
                           {ImageKind::kLightTransmittance, 0},
                           {ImageKind::kLightBuffer, 1},
                           {ImageKind::kBeauty}});
  shown->request.sweep_on = SweepOn::kDevice;
  add("cancelled on the CPU", sweep(64))->cancelled = true;
  Shot* const cancelled = add("cancelled on the device", sweep(64));
  cancelled->request.sweep_on = SweepOn::kDevice;
  cancelled->cancelled = true;
  scene = slices(96);
  for (Light& light : scene.lights) light.shadow_density = glm::vec3(0.0F);
  add("unshadowed", scene);
  add("slices again", slices(96));
  return shots;
}

class FramesInFlight : public testing::Test, public testing::WithParamInterface<int> {
 protected:
  // The last one made has the context that is current: these come before any other.
  static void SetUpTestSuite() { OneByOne(); }

  static std::unique_ptr<FrameRenderer> MakeRenderer(int frames_in_flight) {
    return *FrameRenderer::Create("auto",
                                  {.max_texture_size = 128, .frames_in_flight = frames_in_flight});
  }

  // What becomes of each with one frame at a time; of the cancelled, unless they were.
  static const std::vector<absl::StatusOr<FrameResult>>& OneByOne() {
    static const auto* const results = [] {
      auto* const frames = new std::vector<absl::StatusOr<FrameResult>>;
      const auto renderer = MakeRenderer(1);
      for (const Shot& shot : MixedSequence()) {
        frames->push_back(renderer->Render(shot.request, {}));
      }
      return frames;
    }();
    return *results;
  }

  static void ExpectAsOneByOne(const Shot& shot, size_t number,
                               const absl::StatusOr<FrameResult>& frame) {
    SCOPED_TRACE(shot.name);
    if (shot.cancelled) {
      EXPECT_TRUE(absl::IsCancelled(frame.status())) << frame.status();
      return;
    }
    const absl::StatusOr<FrameResult>& alone = OneByOne()[number];
    ASSERT_EQ(frame.status(), alone.status());
    if (!frame.ok()) return;
    ASSERT_EQ(frame->images.size(), alone->images.size());
    for (size_t i = 0; i < frame->images.size(); ++i) {
      EXPECT_EQ(frame->images[i].width, alone->images[i].width);
      EXPECT_EQ(frame->images[i].layers, alone->images[i].layers);
      EXPECT_EQ(frame->images[i].channels, alone->images[i].channels);
      EXPECT_TRUE(frame->images[i].pixels == alone->images[i].pixels) << "output " << i;
    }
    EXPECT_EQ(frame->lights.size(), alone->lights.size());
  }
};

INSTANTIATE_TEST_SUITE_P(Numbers, FramesInFlight, testing::Values(2, 3),
                         [](const auto& instance) { return std::to_string(instance.param); });

// As many as there may be are begun before the oldest is finished.
TEST_P(FramesInFlight, AreTheSameAsOneByOne) {
  const auto renderer = MakeRenderer(GetParam());
  ASSERT_EQ(renderer->frames_in_flight(), static_cast<size_t>(GetParam()));
  struct Flight {
    std::stop_source stop;
    absl::StatusOr<std::unique_ptr<FrameRenderer::Begun>> frame;
  };
  const std::vector<Shot> shots = MixedSequence();
  std::vector<Flight> flights;
  const auto finish = [&](size_t number) {
    Flight& flight = flights[number];
    if (shots[number].cancelled) flight.stop.request_stop();
    absl::StatusOr<FrameResult> frame =
        flight.frame.ok() ? renderer->Finish(*std::move(flight.frame)) : flight.frame.status();
    ExpectAsOneByOne(shots[number], number, frame);
  };
  const auto in_flight = static_cast<size_t>(GetParam());
  for (size_t k = 0; k < shots.size(); ++k) {
    Flight flight;
    flight.frame = renderer->Begin(shots[k].request, flight.stop.get_token());
    flights.push_back(std::move(flight));
    if (k + 1 >= in_flight) finish(k + 1 - in_flight);
  }
  for (size_t k = shots.size() + 1 - in_flight; k < shots.size(); ++k) finish(k);
}

TEST_P(FramesInFlight, AreReportedInTheOrderOfSubmission) {
  auto engine = StartRenderThread(
      {.renderer = {.max_texture_size = 128, .frames_in_flight = GetParam()}, .warm_up = true});
  ASSERT_TRUE(engine.ok()) << engine.status();
  const std::vector<Shot> shots = MixedSequence();
  // Of the engine's thread until all are done.
  std::vector<absl::StatusOr<FrameResult>> frames(shots.size(), absl::UnknownError("not reported"));
  size_t reported = 0;
  std::vector<size_t> order;  // of those that were not cancelled, which may come sooner
  std::promise<void> all_done;
  for (size_t k = 0; k < shots.size(); ++k) {
    std::stop_source stop;
    if (shots[k].cancelled) stop.request_stop();
    const absl::Status accepted =
        (*engine)->Submit(shots[k].request, stop.get_token(), [&, k](auto frame) {
          frames[k] = std::move(frame);
          if (!shots[k].cancelled) order.push_back(k);
          if (++reported == shots.size()) all_done.set_value();
        });
    ASSERT_TRUE(accepted.ok()) << accepted;
  }
  all_done.get_future().wait();
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  for (size_t k = 0; k < shots.size(); ++k) ExpectAsOneByOne(shots[k], k, frames[k]);
}

// A stop between the halves ends a frame, whose memory serves others.
TEST_P(FramesInFlight, MayBeDroppedAtAnyTime) {
  const auto renderer = MakeRenderer(GetParam());
  const FrameRequest request = test::Beauty(SceneOf(ShadowTechniqueKind::kHalfAngle, 96));
  const FrameRequest other = test::Beauty(SceneOf(ShadowTechniqueKind::kHalfAngle, 80));
  const Image alone = renderer->Render(request, {})->images.at(0);
  for (int k = 0; k < 4; ++k) {
    std::stop_source stop;
    auto stopped = renderer->Begin(other, stop.get_token());
    auto dropped = renderer->Begin(other, {});
    auto kept = renderer->Begin(request, {});
    ASSERT_TRUE(stopped.ok() && dropped.ok() && kept.ok());
    stop.request_stop();
    EXPECT_TRUE(renderer->CanFinish(**stopped, std::chrono::seconds(0)));
    EXPECT_TRUE(absl::IsCancelled(renderer->Finish(*std::move(stopped)).status()));
    dropped->reset();
    auto after = renderer->Begin(other, {});
    ASSERT_TRUE(after.ok());
    const auto frame = renderer->Finish(*std::move(kept));
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_TRUE(frame->images.at(0).pixels == alone.pixels) << k;
  }
}

TEST_P(FramesInFlight, ReportTheirOwnStages) {
  const auto renderer = MakeRenderer(GetParam());
  const FrameRequest request = test::Beauty(SceneOf(ShadowTechniqueKind::kHalfAngle, 96));
  auto first = renderer->Begin(request, {});
  auto second = renderer->Begin(request, {});
  ASSERT_TRUE(first.ok() && second.ok());
  for (auto* const frame : {&second, &first}) {
    const auto result = renderer->Finish(*std::move(*frame));
    ASSERT_TRUE(result.ok()) << result.status();
    std::vector<std::string> on_device;
    for (const StageTiming& timing : result->timings) {
      EXPECT_GE(timing.milliseconds, 0.0) << timing.stage;
      if (timing.on_device) on_device.push_back(timing.stage);
    }
    EXPECT_THAT(on_device, testing::ElementsAre("clear", "project", "light and composite", "copy"));
  }
}

TEST(FramesInFlightByDevice, AreOneOnACpuRasterizerAndTwoElsewhere) {
  const auto renderer = *FrameRenderer::Create("auto");
  EXPECT_EQ(renderer->frames_in_flight(), renderer->device().software ? 1U : 2U);
}

class ReadbackTest : public test::DeviceTest {
 protected:
  // A texture of one color.
  static gl::Texture Filled(int width, int height, float value) {
    gl::Texture texture({.format = GL_RGBA32F, .width = width, .height = height});
    const std::vector<float> color = {value, 2 * value, 3 * value, 4 * value};
    glClearTexImage(texture.name(), 0, GL_RGBA, GL_FLOAT, color.data());
    return texture;
  }

  static Image Rgba(int width, int height, int layers = 1) {
    return {width, height, layers, {"R", "G", "B", "A"}, {}};
  }
};

// With and without staging memory: parts, layers, sums, channels, buffers.
TEST_F(ReadbackTest, PutsEverythingInItsPlace) {
  gl::StagingMemory staging;
  for (gl::StagingMemory* const memory : {static_cast<gl::StagingMemory*>(nullptr), &staging}) {
    Image parts = Rgba(5, 3);
    Image layers{4, 2, 3, {"Y"}, {}};
    Image rgb{3, 3, 1, {"R", "G", "B"}, {}};
    Image floats{2, 2, 1, {"Y"}, {}};
    Readback readback(memory);
    readback.Copy(Filled(2, 3, 1), {.image = parts});
    readback.Copy(Filled(9, 7, 2), {4, 1, 3, 3}, {.image = parts, .at = {2, 0}});
    readback.Copy(Filled(3, 2, 10), {.image = parts, .at = {2, 1}, .add = true});
    for (int layer = 2; layer >= 0; --layer) {
      readback.Copy(Filled(4, 2, static_cast<float>(layer)), {.image = layers, .layer = layer});
    }
    readback.Copy(Filled(3, 3, 5), {rgb});
    readback.Copy(gl::MakeBuffer("floats", std::vector<float>{1, 2, 3, 4}), floats);
    EXPECT_EQ(rgb.pixels.empty(), memory != nullptr);
    readback.Submit();
    while (!readback.Arrived(std::chrono::milliseconds(1))) {
    }
    readback.Deliver();

    const auto pixel = [&](int x, int y) {
      const float* const at = test::PixelAt(parts, x, y);
      return std::vector<float>(at, at + 4);
    };
    EXPECT_EQ(pixel(1, 2), std::vector<float>({1, 2, 3, 4}));
    EXPECT_EQ(pixel(4, 0), std::vector<float>({2, 4, 6, 8}));
    EXPECT_EQ(pixel(2, 1), std::vector<float>({12, 24, 36, 8}));
    EXPECT_EQ(layers.pixels, std::vector<float>({0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1,
                                                 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2}));
    EXPECT_EQ(rgb.pixels[4], 10.0F);
    EXPECT_EQ(floats.pixels, std::vector<float>({1, 2, 3, 4}));
  }
}

TEST_F(ReadbackTest, ReusesItsMemory) {
  gl::StagingMemory staging;
  for (int frame = 0; frame < 5; ++frame) {
    Image first = Rgba(64, 64);
    Image second = Rgba(32, 16);
    Readback readback(&staging);
    readback.Copy(Filled(64, 64, 1), {first});
    readback.Copy(Filled(32, 16, 2), {second});
    readback.Submit();
    while (!readback.Arrived(std::chrono::milliseconds(1))) {
    }
    readback.Deliver();
    EXPECT_EQ(second.pixels.back(), 8.0F);
  }
  EXPECT_EQ(staging.blocks_made(), 1U);
  EXPECT_GT(staging.idle_bytes(), 0U);
  staging.Clear();
  EXPECT_EQ(staging.idle_bytes(), 0U);
}

// What does not fit beside what was copied before waits for it, and still comes after it.
TEST_F(ReadbackTest, HoldsNoMoreThanItsBound) {
  gl::StagingMemory staging;
  constexpr int kSide = 2048;  // 64 MiB
  const gl::Texture texture = Filled(kSide, kSide, 1);
  Image sum = Rgba(kSide, kSide);
  Readback readback(&staging);
  for (int copy = 0; copy < 6; ++copy) {
    readback.Copy(texture, {.image = sum, .add = copy > 0});
  }
  readback.Submit();
  while (!readback.Arrived(std::chrono::milliseconds(1))) {
  }
  readback.Deliver();
  EXPECT_EQ(sum.pixels[0], 6.0F);
  EXPECT_EQ(sum.pixels.back(), 4.0F);
  EXPECT_LE(staging.blocks_made() * sizeof(float) * 4 * kSide * kSide, Readback::kMostStagedBytes);
}

}  // namespace
}  // namespace halflight
