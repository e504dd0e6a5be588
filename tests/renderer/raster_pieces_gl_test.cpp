// Raster draws in pieces: which, and that a stop ends a frame between two of them.
#include "renderer/raster_pieces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "shaders/bindings.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using Range = std::pair<uint32_t, uint32_t>;

class RasterPiecesTest : public test::GlTest {
 protected:
  void SetUp() override { Renderer(); }  // whose context is current

  // What is drawn of places [0, costs.size()); a stop is requested by the draw number `stop_at`.
  absl::Status Draw(RasterPieces& pieces, const QuadCosts& costs, size_t stop_at = 0) {
    std::stop_source stop;
    return pieces.Draw(costs, 0, static_cast<uint32_t>(costs.size()), stop.get_token(),
                       [&](uint32_t begin, uint32_t end) {
                         drawn_.emplace_back(begin, end);
                         if (drawn_.size() == stop_at) stop.request_stop();
                         return absl::OkStatus();
                       });
  }

  std::vector<Range> drawn_;
};

QuadCosts QuartersOfAPiece() {
  return QuadCosts(10, static_cast<float>(RasterPieces::kMostCost / 4));
}

TEST_F(RasterPiecesTest, LeaveASmallDrawWhole) {
  RasterPieces pieces(true);
  ASSERT_TRUE(Draw(pieces, QuadCosts(1000, 100.0F)).ok());
  EXPECT_THAT(drawn_, testing::ElementsAre(Range(0, 1000)));
  EXPECT_EQ(pieces.ended(), 0U);
}

TEST_F(RasterPiecesTest, CutALargeDrawWhereItHasCostEnough) {
  RasterPieces pieces(true);
  ASSERT_TRUE(Draw(pieces, QuartersOfAPiece()).ok());
  EXPECT_THAT(drawn_, testing::ElementsAre(Range(0, 4), Range(4, 8), Range(8, 10)));
  // What the last piece lacks the next draw may have.
  ASSERT_TRUE(Draw(pieces, QuartersOfAPiece()).ok());
  EXPECT_EQ(drawn_.at(3), Range(0, 2));
  EXPECT_EQ(pieces.ended(), 5U);
}

TEST_F(RasterPiecesTest, HoldOneQuadAtLeast) {
  RasterPieces pieces(true);
  ASSERT_TRUE(Draw(pieces, QuadCosts(2, static_cast<float>(5 * RasterPieces::kMostCost))).ok());
  EXPECT_THAT(drawn_, testing::ElementsAre(Range(0, 1), Range(1, 2)));
}

TEST_F(RasterPiecesTest, EndWithTheOneThatIsStopped) {
  RasterPieces pieces(true);
  EXPECT_TRUE(absl::IsCancelled(Draw(pieces, QuartersOfAPiece(), 2)));
  EXPECT_THAT(drawn_, testing::ElementsAre(Range(0, 4), Range(4, 8)));
}

TEST_F(RasterPiecesTest, AreNotCutOnAGpu) {
  RasterPieces pieces(false);
  ASSERT_TRUE(Draw(pieces, QuartersOfAPiece()).ok());
  EXPECT_THAT(drawn_, testing::ElementsAre(Range(0, 10)));
}

TEST_F(RasterPiecesTest, CostWhatTheTargetShowsOfThem) {
  const std::vector<glm::vec4> rects = {{1, 1, 4, 3},
                                        {-5, -5, 5, 10},
                                        {12, 2, 15, 4},
                                        {1e30F, 1e30F, -1e30F, -1e30F},
                                        {-1e30F, 0, 1e30F, 2}};
  std::vector<shader::Splat> splats;
  for (const glm::vec4& rect : rects) splats.push_back({.rect = rect, .center = {}, .optics = {}});
  const QuadCosts costs =
      RasterPieces(true).CostsOf(gl::MakeBuffer("splats", splats), splats.size(), {10, 20});
  ASSERT_EQ(costs.size(), rects.size());
  std::vector<float> fragments;
  for (const float cost : costs) fragments.push_back(cost - costs[3]);
  EXPECT_THAT(fragments, testing::ElementsAre(6, 50, 0, 0, 20));
}

// Frames of one slice that would take a minute and more.
class LongRasterDraw : public test::GlTest, public testing::WithParamInterface<bool> {
 protected:
  static Scene SceneOf(size_t particles, bool shadows) {
    Scene scene = test::BallScene(particles, 1024);
    scene.material.radius = 50.0F;  // covers the image
    scene.shadow.slices = 1;
    scene.shadow.compositor = SliceCompositor::kRaster;
    if (!shadows) scene.lights[0].shadow_density = glm::vec3(0.0F);
    return scene;
  }
};

INSTANTIATE_TEST_SUITE_P(Shadows, LongRasterDraw, testing::Bool(),
                         [](const auto& instance) { return instance.param ? "with" : "without"; });

TEST_P(LongRasterDraw, EndsWhenItIsStopped) {
  if (!Renderer().device().software) GTEST_SKIP() << "GPUs are given draws whole";
  constexpr size_t kParticles = 4096;
  Render(test::Beauty(SceneOf(2, GetParam())));  // so that the programs are there
  const uint64_t before = Renderer().raster_pieces().ended();
  std::stop_source stop;
  std::thread stopper([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop.request_stop();
  });
  const auto frame =
      Renderer().Render(test::Beauty(SceneOf(kParticles, GetParam())), stop.get_token());
  stopper.join();
  EXPECT_TRUE(absl::IsCancelled(frame.status())) << frame.status();
  const double pieces_of_all = kParticles * 0x1p20 / RasterPieces::kMostCost;
  EXPECT_LT(static_cast<double>(Renderer().raster_pieces().ended() - before), pieces_of_all / 2);
}

}  // namespace
}  // namespace halflight
