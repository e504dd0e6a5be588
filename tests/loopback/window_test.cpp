// Which pixels come back: crop windows, supersampling, downsampling.

#include <array>

#include <gtest/gtest.h>

#include "tests/encode/decoded.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

constexpr int kWidth = 48;
constexpr int kHeight = 36;

Scene WideScene(int scale = 1) {
  Scene scene = test::BallScene(250, 32);
  scene.camera = test::LookAt({0, 0, 4}, {0, 0, 0}, kWidth * scale, kHeight * scale);
  return scene;
}

std::vector<float> PixelsOf(client::Client& client, const Scene& scene) {
  return FloatsOf(MustRender(client, RequestOf(scene)).outputs[0]);
}

TEST(Window, CropIsThatPartOfTheWholeImage) {
  const TestServer server;
  client::Client client = server.Connect();
  const auto whole = PixelsOf(client, WideScene());
  ASSERT_EQ(whole.size(), kWidth * kHeight * 4U);
  for (const PixelRect window :
       {PixelRect{13, 7, 20, 11}, PixelRect{0, 0, 1, 1}, PixelRect{24, 18, 24, 18}}) {
    Scene scene = WideScene();
    scene.camera.window = window;
    v1::RenderFrameRequest request = RequestOf(scene);
    *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY, v1::IMAGE_FORMAT_EXR_FLOAT);
    const client::RenderedFrame frame = MustRender(client, request);
    std::vector<float> expected;
    for (int y = window.y; y < window.y + window.height; ++y) {
      const float* const row = whole.data() + static_cast<size_t>(y) * kWidth * 4;
      const size_t first = static_cast<size_t>(window.x) * 4;
      const size_t count = static_cast<size_t>(window.width) * 4;
      expected.insert(expected.end(), row + first, row + first + count);
    }
    EXPECT_LT(MaxDifference(FloatsOf(frame.outputs[0]), expected), 1e-5);
    EXPECT_EQ(frame.header.outputs(0).width(), static_cast<uint32_t>(window.width));
    EXPECT_EQ(frame.header.outputs(0).height(), static_cast<uint32_t>(window.height));

    const auto parts = Decode(frame.outputs[1], "exr");
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts[0].offset, (std::array{window.x, window.y}));
    EXPECT_EQ(parts[0].whole_window, (std::array{0, 0, kWidth, kHeight}));
  }
}

TEST(Window, SupersamplingAveragesALargerImage) {
  const TestServer server;
  client::Client client = server.Connect();
  const auto large = PixelsOf(client, WideScene(2));
  Scene scene = WideScene();
  scene.sampling.supersample = 2;
  const auto averaged = PixelsOf(client, scene);
  ASSERT_EQ(averaged.size(), kWidth * kHeight * 4U);
  std::vector<float> expected;
  const auto at = [&](size_t x, size_t y, size_t c) { return large[(y * kWidth * 2 + x) * 4 + c]; };
  for (size_t y = 0; y < kHeight; ++y) {
    for (size_t x = 0; x < kWidth; ++x) {
      for (size_t c = 0; c < 4; ++c) {
        expected.push_back(0.25F * (at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) +
                                    at(2 * x, 2 * y + 1, c) + at(2 * x + 1, 2 * y + 1, c)));
      }
    }
  }
  EXPECT_LT(MaxDifference(averaged, expected), 1e-5);
  EXPECT_GT(MaxDifference(averaged, PixelsOf(client, WideScene())), 1e-3);
}

TEST(Window, DownsamplingKeepsTheSizeAndTheLook) {
  const TestServer server;
  client::Client client = server.Connect();
  const auto exact = PixelsOf(client, WideScene(3));
  // 5 divides neither side.
  for (const int factor : {2, 5}) {
    Scene scene = WideScene(3);
    scene.sampling.downsample = factor;
    const auto coarse = PixelsOf(client, scene);
    ASSERT_EQ(coarse.size(), exact.size());
    EXPECT_GT(MaxDifference(coarse, exact), 1e-4);
    double coarse_sum = 0.0;
    double exact_sum = 0.0;
    for (size_t i = 0; i < exact.size(); ++i) {
      coarse_sum += coarse[i];
      exact_sum += exact[i];
    }
    EXPECT_NEAR(coarse_sum / exact_sum, 1.0, 0.02) << factor;
  }
}

}  // namespace
}  // namespace halflight::loopback
