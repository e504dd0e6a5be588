// What a render command has to do, before any server is asked: what it chooses, and what it
// refuses.
#include "client/cli/render_job.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "client/cli/exit_code.h"
#include "client/status_text.h"
#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kCloud = "x,y,z,radius,opacity\n0,0,0,0.5,0.25\n1,1,1,0.5,0.25\n";

class RenderJobTest : public testing::Test {
 protected:
  void Output(const std::string& name, v1::OutputKind kind = v1::OUTPUT_KIND_BEAUTY) {
    options_.outputs.push_back({kind, directory_ / name});
  }

  TestDirectory directory_;
  RenderOptions options_;
};

TEST_F(RenderJobTest, LetsFlagsStandInForTheFilesValues) {
  options_.input = directory_.Write("a.csv", kCloud);
  EXPECT_EQ(ReadInput(options_, options_.input)->radii.size(), 2U);
  options_.radius = 0.25;
  options_.opacity = 0.5;
  const auto particles = ReadInput(options_, options_.input);
  EXPECT_TRUE(particles->radii.empty());
  EXPECT_TRUE(particles->opacities.empty());
}

TEST_F(RenderJobTest, ChoosesOnlyWhatIsOpen) {
  options_.input = directory_.Write("a.csv", kCloud);
  Output("a.png");
  const auto job = PlanRender(options_);
  ASSERT_TRUE(job.ok()) << job.status();
  const v1::Scene& scene = job->request.scene();
  EXPECT_FALSE(scene.material().has_radius());   // the file has radii
  EXPECT_FALSE(scene.material().has_opacity());  // and opacities
  EXPECT_TRUE(scene.camera().look_at().has_eye());
  EXPECT_EQ(scene.lighting().lights_size(), 1);
  EXPECT_FALSE(scene.has_shadow());
}

TEST_F(RenderJobTest, ChoosesOnceForASequence) {
  directory_.Write("a.1.csv", "x,y,z\n0,0,0\n1,1,1\n");
  directory_.Write("a.2.csv", "x,y,z\n0,0,0\n9,9,9\n");
  options_.input = directory_ / "a.%d.csv";
  Output("a.%d.png");
  options_.frames = {1, 2};
  const auto both = PlanRender(options_);
  options_.frames = {1};
  const auto first = PlanRender(options_);
  ASSERT_TRUE(both.ok() && first.ok());
  EXPECT_EQ(both->request.scene().material().radius(), first->request.scene().material().radius());
  // The camera stands back for the last frame, which is larger.
  EXPECT_GT(both->request.scene().camera().look_at().eye().z(),
            first->request.scene().camera().look_at().eye().z() + 5);
}

TEST_F(RenderJobTest, PointsALightAlongTheView) {
  options_.input = directory_.Write("a.csv", kCloud);
  Output("a.png");
  options_.eye = Vec3{0, 0, 7};
  options_.target = Vec3{0, 0, 2};
  options_.lights = {LightFlag{}};
  const auto job = PlanRender(options_);
  ASSERT_TRUE(job.ok()) << job.status();
  const v1::Light& light = job->request.scene().lighting().lights(0);
  EXPECT_EQ(light.directional().direction().z(), -5);
  // The same view as a matrix gives the same light.
  options_.eye.reset();
  options_.target.reset();
  options_.scene_path = directory_.Write(
      "s.json",
      R"({"scene": {"camera": {"world_to_camera": {"elements": [1,0,0,0, 0,1,0,0, 0,0,1,-7, 0,0,0,1]}}}})");
  const auto by_matrix = PlanRender(options_);
  ASSERT_TRUE(by_matrix.ok()) << by_matrix.status();
  EXPECT_EQ(by_matrix->request.scene().lighting().lights(0).directional().direction().z(), -1);
}

TEST_F(RenderJobTest, RefusesToWriteOneFileTwice) {
  options_.input = directory_.Write("a.csv", kCloud);
  Output("a.png");
  for (const char* again : {"a.png", "./a.png", "none/../a.png"}) {
    options_.outputs.resize(1);
    Output(again, v1::OUTPUT_KIND_COVERAGE);
    const absl::Status status = PlanRender(options_).status();
    EXPECT_EQ(ExitCodeOf(status), ExitCode::kUsage) << again;
    EXPECT_THAT(MessageOf(status), HasSubstr("written twice"));
  }
}

TEST_F(RenderJobTest, RefusesToWriteOverWhatItReads) {
  options_.format = "csv";
  for (const char* name : {"a.1.bin", "a.2.bin"}) {
    directory_.Write(name, kCloud);
  }
  std::filesystem::create_symlink(directory_ / "a.2.bin", directory_ / "link.bin");
  options_.input = directory_ / "a.1.bin";
  Output("./a.1.bin");
  EXPECT_THAT(MessageOf(PlanRender(options_).status()), HasSubstr("a.1.bin' is read too"));
  options_.input = directory_ / "link.bin";
  options_.outputs[0].path = directory_ / "a.2.bin";
  EXPECT_THAT(MessageOf(PlanRender(options_).status()), HasSubstr("a.2.bin' is read too"));
  // Of a later frame, too.
  options_.input = directory_ / "a.%d.bin";
  options_.outputs[0].path = directory_ / "a.%01d.bin";
  options_.frames = {1, 2};
  EXPECT_EQ(ExitCodeOf(PlanRender(options_).status()), ExitCode::kUsage);
}

TEST_F(RenderJobTest, FramesParticlesWhereTheyHaveMovedTo) {
  options_.input = directory_.Write("rest.csv", "x,y,z,radius\n0,0,0,1\n0,2,0,1\n");
  Output("a.png");
  const auto at_rest = PlanRender(options_);
  options_.input =
      directory_.Write("moves.csv", "x,y,z,radius,vx,vy,vz\n0,0,0,1,5,0,-1\n0,2,0,1,5,0,-1\n");
  options_.time_offset_s = 2;
  const auto moved = PlanRender(options_);
  ASSERT_TRUE(at_rest.ok() && moved.ok()) << at_rest.status() << moved.status();
  const v1::Vector3& before = at_rest->request.scene().camera().look_at().target();
  const v1::Vector3& after = moved->request.scene().camera().look_at().target();
  EXPECT_NEAR(after.x(), before.x() + 10, 1e-5);
  EXPECT_NEAR(after.z(), before.z() - 2, 1e-5);
  EXPECT_THAT(moved->first_particles->positions, ElementsAre(0, 0, 0, 0, 2, 0)) << "as in the file";
}

}  // namespace
}  // namespace halflight::client
