// One renderer for all tests of a process.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "renderer/frame_renderer.h"
#include "tests/renderer/test_scene.h"

namespace halflight::test {

class GlTest : public testing::Test {
 protected:
  static FrameRenderer& Renderer() {
    static const std::unique_ptr<FrameRenderer> renderer = [] {
      absl::StatusOr<std::unique_ptr<FrameRenderer>> made = FrameRenderer::Create("auto");
      if (!made.ok()) {
        ADD_FAILURE() << made.status();
        std::abort();
      }
      return *std::move(made);
    }();
    return *renderer;
  }

  // Fails the test where the frame fails.
  static FrameResult Render(const FrameRequest& request) {
    absl::StatusOr<FrameResult> frame = Renderer().Render(request, {});
    EXPECT_TRUE(frame.ok()) << frame.status();
    return frame.ok() ? *std::move(frame) : FrameResult{};
  }

  static Image RenderBeauty(const Scene& scene) { return Render(Beauty(scene)).images.at(0); }
};

inline const float* PixelAt(const Image& image, int x, int y) {
  return &image.pixels[(static_cast<size_t>(y) * static_cast<size_t>(image.width) +
                        static_cast<size_t>(x)) *
                       image.channels.size()];
}

inline double MaxDifference(const Image& a, const Image& b) {
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  double largest = 0.0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]));
  }
  return largest;
}

}  // namespace halflight::test
