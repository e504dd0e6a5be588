// The render command as a whole, against a service in this process: files in, files out, exit
// codes.
#include "client/cli/render_command.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "client/cli/exit_code.h"
#include "client/cli/file_writer.h"
#include "client/cli/progress.h"
#include "client/cli/render_job.h"
#include "client/cli/request_json.h"
#include "client/status_text.h"
#include "tests/client/fake_service.h"
#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr const char* kCloud = "x,y,z,radius,opacity\n0,0,0,0.5,0.25\n1,1,1,0.5,0.25\n";

std::string Contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

class RenderCommandTest : public testing::Test {
 protected:
  RenderCommandTest() {
    options_.connection.server = service_.address();
    options_.connection.timeout_s = 20;
    options_.quiet = true;
  }
  void Output(const std::string& name, v1::OutputKind kind = v1::OUTPUT_KIND_BEAUTY) {
    options_.outputs.push_back({kind, directory_ / name});
  }
  absl::Status Run() { return RunRender(options_, stop_.get_token()); }
  // Files anywhere below the directory.
  [[nodiscard]] size_t Files() const {
    size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(directory_ / ".")) {
      files += entry.is_regular_file() ? 1 : 0;
    }
    return files;
  }

  FakeService service_;
  TestDirectory directory_;
  RenderOptions options_;
  std::stop_source stop_;
};

TEST_F(RenderCommandTest, WritesEveryOutputIntoNewDirectories) {
  options_.input = directory_.Write("a.csv", kCloud);
  Output("deep/er/a.png");
  Output("light.exr", v1::OUTPUT_KIND_LIGHT_BUFFER);
  ASSERT_TRUE(Run().ok());
  EXPECT_EQ(Contents(directory_ / "deep/er/a.png").size(), 32U + 1 + 400000);
  EXPECT_EQ(Contents(directory_ / "light.exr").back(), '\x01');
  EXPECT_EQ(Files(), 3U);  // no temporary file is left
}

TEST_F(RenderCommandTest, RendersASequenceThroughOneStream) {
  for (const char* name : {"a.0003.csv", "a.0005.csv", "a.0007.csv"}) {
    directory_.Write(name, kCloud);
  }
  options_.input = directory_ / "a.%04d.csv";
  options_.frames = {3, 5, 7};
  options_.request_id = "me";
  Output("f.%d.png");
  ASSERT_TRUE(Run().ok());
  EXPECT_THAT(Contents(directory_ / "f.5.png"), HasSubstr("me.5"));
  EXPECT_TRUE(fs::exists(directory_ / "f.3.png") && fs::exists(directory_ / "f.7.png"));
  EXPECT_EQ(service_.Calls("RenderSequence"), 1);
}

TEST_F(RenderCommandTest, AsksForNothingWhileAFrameIsMissing) {
  directory_.Write("a.1.csv", kCloud);
  directory_.Write("a.3.csv", kCloud);
  options_.input = directory_ / "a.%d.csv";
  options_.frames = {1, 2, 3};
  Output("f.%d.png");
  const absl::Status status = Run();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kInput);
  EXPECT_THAT(MessageOf(status), HasSubstr("a.2.csv"));
  EXPECT_THAT(MessageOf(status), HasSubstr("1 of 3"));
  EXPECT_EQ(service_.Calls("QueryUpload") + service_.Calls("RenderSequence"), 0);
  EXPECT_EQ(Files(), 2U);
}

TEST_F(RenderCommandTest, UploadsNothingOfAMalformedFile) {
  options_.input = directory_.Write("a.csv", "x,y,z\n1,2,oops\n");
  Output("a.png");
  const absl::Status status = Run();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kInput);
  EXPECT_THAT(MessageOf(status), HasSubstr("line 2"));
  EXPECT_EQ(service_.Calls("UploadParticles"), 0);
}

TEST_F(RenderCommandTest, EndsASequenceAtAMalformedFileAndKeepsTheFramesBefore) {
  for (const int frame : {1, 2, 3, 4}) {
    directory_.Write("a." + std::to_string(frame) + ".csv", frame == 3 ? "x,y,z\n1\n" : kCloud);
  }
  options_.input = directory_ / "a.%d.csv";
  options_.frames = {1, 2, 3, 4};
  Output("f.%d.png");
  const absl::Status status = Run();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kInput);
  EXPECT_THAT(MessageOf(status), HasSubstr("a.3.csv: line 2"));
  EXPECT_TRUE(fs::exists(directory_ / "f.2.png"));
  EXPECT_FALSE(fs::exists(directory_ / "f.3.png"));
}

TEST_F(RenderCommandTest, NamesTheFileOfAFrameThatTheServerRefused) {
  for (const char* name : {"a.10.csv", "a.11.csv"}) {
    directory_.Write(name, kCloud);
  }
  service_.before_frame = [](uint64_t index) {
    return index == 1 ? grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "bad radius")
                      : grpc::Status::OK;
  };
  options_.input = directory_ / "a.%d.csv";
  options_.frames = {10, 11};
  Output("f.%d.png");
  const absl::Status status = Run();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kRefused);
  EXPECT_THAT(MessageOf(status), HasSubstr("1 of 2 frames done"));
  EXPECT_THAT(MessageOf(status), HasSubstr("a.11.csv: bad radius"));
}

TEST_F(RenderCommandTest, IsDoneWithTheLastFrameWhateverTheServerSendsThen) {
  for (const char* name : {"a.1.csv", "a.2.csv"}) {
    directory_.Write(name, kCloud);
  }
  options_.input = directory_ / "a.%d.csv";
  options_.frames = {1, 2};
  Output("f.%d.png");
  service_.end_of_sequence = {grpc::StatusCode::INTERNAL, "late fault"};
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kOk);
  service_.unasked_frame = 2;
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kOk);
  EXPECT_EQ(Files(), 4U);
}

TEST_F(RenderCommandTest, TellsCausesApartByExitCode) {
  options_.input = directory_.Write("a.csv", kCloud);
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kUsage);  // no output
  Output("a.png");
  service_.FailNext("RenderFrame", {{grpc::StatusCode::INVALID_ARGUMENT, "no"},
                                    {grpc::StatusCode::INTERNAL, "fault"},
                                    {grpc::StatusCode::DEADLINE_EXCEEDED, "late"}});
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kRefused);
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kFailed);
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kServerUnavailable);
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kOk);
  options_.outputs[0].path = directory_ / "a.csv/below-a-file.png";
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kOutput);
  options_.outputs[0].path = directory_ / "b.png";
  options_.connection.server = "nonsense";
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kUsage);
  options_.connection.server = service_.address();
  stop_.request_stop();
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kInterrupted);
}

TEST_F(RenderCommandTest, TakesNoTimeoutForNoneButZero) {
  service_.tamper = [](auto&) { std::this_thread::sleep_for(std::chrono::milliseconds(50)); };
  options_.input = directory_.Write("a.csv", kCloud);
  Output("a.png");
  options_.connection.timeout_s = 0.0004;
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kServerUnavailable);
  options_.connection.timeout_s = 0;
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kOk);
}

TEST_F(RenderCommandTest, AsksForTheFramesOfAPattern) {
  options_.input = directory_ / "a.%04d.csv";
  Output("a.png");
  const absl::Status status = Run();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kUsage);
  EXPECT_THAT(MessageOf(status), HasSubstr("--frames: is missing"));
  // A file that has such a name is a file.
  options_.input = directory_.Write("a.%04d.csv", kCloud);
  EXPECT_TRUE(Run().ok());
}

TEST_F(RenderCommandTest, RendersNothingThatItMayNotWrite) {
  if (geteuid() == 0) {
    GTEST_SKIP() << "root may write everywhere";
  }
  options_.input = directory_.Write("a.csv", kCloud);
  fs::create_directory(directory_ / "sealed");
  fs::permissions(directory_ / "sealed", fs::perms::owner_read | fs::perms::owner_exec);
  Output("sealed/a.png");
  EXPECT_EQ(ExitCodeOf(Run()), ExitCode::kOutput);
  EXPECT_EQ(service_.Calls("RenderFrame"), 0);
}

TEST_F(RenderCommandTest, RendersAnEmptyFile) {
  options_.input = directory_.Write("a.csv", "x,y,z\n");
  Output("a.png");
  const absl::Status status = Run();
  EXPECT_TRUE(status.ok()) << status;
}

TEST_F(RenderCommandTest, PrintsASceneThatGivesTheSameRequestAgain) {
  options_.input = directory_.Write("a.csv", "x,y,z\n0,0,0\n1,2,3\n");
  options_.print_scene = true;
  Output("a.%d.png");
  testing::internal::CaptureStdout();
  ASSERT_TRUE(Run().ok());
  const std::string printed = testing::internal::GetCapturedStdout();
  options_.scene_path = directory_.Write("scene.json", printed);
  testing::internal::CaptureStdout();
  ASSERT_TRUE(Run().ok());
  EXPECT_EQ(testing::internal::GetCapturedStdout(), printed);
  EXPECT_THAT(printed, HasSubstr("\"radius\""));
  EXPECT_EQ(service_.Calls("RenderFrame"), 0);
}

TEST_F(RenderCommandTest, ReportsOneLineOfJsonAFrame) {
  options_.input = directory_.Write("a \"b\".csv", kCloud);
  options_.quiet = false;
  options_.json = true;
  Output("a.png");
  testing::internal::CaptureStdout();
  ASSERT_TRUE(Run().ok());
  const std::string printed = testing::internal::GetCapturedStdout();
  EXPECT_EQ(std::count(printed.begin(), printed.end(), '\n'), 1);
  EXPECT_THAT(printed, HasSubstr("a \\\"b\\\".csv"));
  EXPECT_THAT(printed, HasSubstr("\"outputs\":[{\"name\":"));
}

TEST(WriteFileWhole, ReplacesAFileAndLeavesNothingBeside) {
  const TestDirectory directory;
  const std::string path = directory.Write("a", "old and longer");
  ASSERT_TRUE(WriteFileWhole(path, "new").ok());
  EXPECT_EQ(Contents(path), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(directory / "."), {}), 1);
  EXPECT_TRUE(WriteFileWhole("/dev/null", "x").ok());
  EXPECT_FALSE(fs::is_regular_file("/dev/null"));
  EXPECT_THAT(MessageOf(WriteFileWhole(directory / "none/a", "x")), HasSubstr("none/a"));
}

TEST(WriteFileWhole, LeavesFilesAloneThatItHasNotMade) {
  const TestDirectory directory;
  const std::string other = directory.Write(fmt::format(".a.{}.0.tmp", getpid()), "another's");
  ASSERT_TRUE(WriteFileWhole(directory / "a", "new").ok());
  EXPECT_EQ(Contents(directory / "a"), "new");
  EXPECT_EQ(Contents(other), "another's");
}

TEST(ProgressLine, ShowsFramesSpeedAndTimeLeft) {
  EXPECT_EQ(ProgressLine(0, 12, 0), "[------------------------------] 0/12 frames");
  EXPECT_EQ(ProgressLine(6, 12, 3),
            "[###############---------------] 6/12 frames  2.00 fps  3.0 s left");
}

}  // namespace
}  // namespace halflight::client
