// halflight as a person calls it: one command, files out, an exit code, nothing left behind.

#include <csignal>

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "halflight/v1/service.pb.h"
#include "tests/encode/decoded.h"
#include "tests/loopback/test_server.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"

namespace halflight::loopback {
namespace {

namespace fs = std::filesystem;
using testing::Contents;
using testing::Ended;
using testing::Folder;
using ::testing::HasSubstr;
using testing::PlumePath;
using testing::Process;
using testing::ProcessesWith;
using testing::RunHalflight;
using testing::WaitFor;

// No server of `folder` runs any more, and its socket is gone.
void ExpectNothingLeft(const Folder& folder) {
  EXPECT_TRUE(fs::is_empty(folder / "tmp"));
  EXPECT_EQ(ProcessesWith(folder / "tmp"), 0);
}

// Quick to render.
std::vector<std::string> Small(std::vector<std::string> arguments) {
  for (const char* argument : {"--size", "80x60", "--slices", "8", "--light-buffer", "64"}) {
    arguments.emplace_back(argument);
  }
  return arguments;
}

float LargestValue(const std::string& path, const std::string& format) {
  const auto parts = Decode(Contents(path), format);
  float largest = 0.0F;
  for (const DecodedPart& part : parts) {
    for (const float value : part.values) {
      largest = std::max(largest, value);
    }
  }
  return largest;
}

TEST(Cli, RendersAFileWithNothingElseAndLeavesNothingBehind) {
  const Folder folder;
  const Ended ended =
      RunHalflight(folder, {"render", PlumePath("0040"), "-o", folder / "frame.png"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(ended.err, "");
  for (const char* chosen : {"radius", "camera", "light"}) {
    EXPECT_THAT(ended.out, HasSubstr(chosen));
  }
  const auto parts = Decode(Contents(folder / "frame.png"), "png");
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].width, 640);
  EXPECT_EQ(parts[0].height, 480);
  EXPECT_GT(LargestValue(folder / "frame.png", "png"), 0.5F);
  ExpectNothingLeft(folder);
}

TEST(Cli, WritesSeveralOutputsOfOneFrame) {
  const Folder folder;
  const Ended ended = RunHalflight(
      folder, Small({"render", PlumePath("0024"), "-o", "light=" + folder / "light.exr", "-o",
                     "layers=" + folder / "layers.exr", "-o", "depth=" + folder / "depth.raw", "-o",
                     "beauty=" + folder / "f.png", "-o", "coverage=" + folder / "c.png"}));
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(Decode(Contents(folder / "light.exr"), "exr").at(0).width, 64);
  EXPECT_EQ(Decode(Contents(folder / "layers.exr"), "exr").size(), 8U);
  EXPECT_EQ(Contents(folder / "depth.raw").size(), 80U * 60U * 4U);
  EXPECT_EQ(Decode(Contents(folder / "f.png"), "png").at(0).height, 60);
  EXPECT_GT(LargestValue(folder / "c.png", "png"), 0.5F);
}

TEST(Cli, StatesTheErrorAndShowsWhereItIs) {
  const Folder folder;
  const Ended ended =
      RunHalflight(folder, Small({"render", "--measure-error=128", PlumePath("0024"),
                                  "--scattering", "0.1", "-o", folder / "f.exr"}));
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("error: relative RMSE "));
  EXPECT_THAT(ended.out, HasSubstr("from 128 of "));
  EXPECT_THAT(ended.out, HasSubstr("without scattering"));
  EXPECT_EQ(Decode(Contents(folder / "f.exr"), "exr").at(0).texts.at("halflight:error.samples"),
            "128");
  const Ended shown =
      RunHalflight(folder, Small({"render", PlumePath("0024"), "-o", "error=" + folder / "e.png"}));
  ASSERT_EQ(shown.code, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("error, 80 x 60, white is "));
  EXPECT_EQ(LargestValue(folder / "e.png", "png"), 1.0F);
}

TEST(Cli, TargetThatIsMissedHasItsOwnExitCodeAndTheFrame) {
  const Folder folder;
  const Ended met = RunHalflight(folder, {"render", PlumePath("0024"), "--size", "80x60",
                                          "--max-error", "0.05", "-o", folder / "met.exr"});
  EXPECT_EQ(met.code, 0) << met.err;
  EXPECT_EQ(met.err, "");
  EXPECT_THAT(met.out, HasSubstr("target: met: error "));
  EXPECT_THAT(met.out, HasSubstr(" of 5 % asked: "));
  EXPECT_EQ(Decode(Contents(folder / "met.exr"), "exr").at(0).texts.at("halflight:target.met"),
            "true");
  const Ended missed =
      RunHalflight(folder, {"render", PlumePath("0024"), "--size", "80x60", "--max-time", "0.01",
                            "--json", "-o", folder / "missed.exr"});
  EXPECT_EQ(missed.code, 7) << missed.err;
  EXPECT_THAT(missed.err, HasSubstr("the target was not met: "));
  EXPECT_THAT(missed.err, HasSubstr("of 0.01 ms asked: "));
  EXPECT_THAT(missed.out, HasSubstr("\"attempts\""));
  EXPECT_THAT(missed.out, HasSubstr("\"exit_code\":7"));
  EXPECT_EQ(Decode(Contents(folder / "missed.exr"), "exr").at(0).width, 80);
}

TEST(Cli, PrintedSceneGivesTheSameBytesAgain) {
  const Folder folder;
  const std::vector<std::string> flags =
      Small({"render", PlumePath("0032"), "--light", "1,-1,0", "--light", "point:9,9,9",
             "--density", "1,0.5,0.25", "--ambient", "0.05", "--phase-g", "0.3", "--exr", "float",
             "-o", folder / "f.exr", "-o", "transmittance=" + folder / "t.exr"});
  std::vector<std::string> print = flags;
  print.emplace_back("--print-scene");
  const Ended printed = RunHalflight(folder, print);
  ASSERT_EQ(printed.code, 0) << printed.err;
  EXPECT_FALSE(fs::exists(folder / "f.exr")) << "it renders nothing";
  v1::RenderFrameRequest request;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(printed.out, &request).ok());
  EXPECT_EQ(request.scene().lighting().lights_size(), 2);

  ASSERT_EQ(RunHalflight(folder, flags).code, 0);
  const std::string scene = folder.Write("scene.json", printed.out);
  const Ended again =
      RunHalflight(folder, {"render", PlumePath("0032"), "--scene", scene, "-o",
                            folder / "again.exr", "-o", "transmittance=" + folder / "again_t.exr"});
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_FALSE(Contents(folder / "f.exr").empty());
  EXPECT_EQ(Contents(folder / "f.exr"), Contents(folder / "again.exr"));
  EXPECT_EQ(Contents(folder / "t.exr"), Contents(folder / "again_t.exr"));
  EXPECT_NE(Contents(folder / "f.exr"), Contents(folder / "t.exr"));
}

TEST(Cli, InfoAsJsonIsTheServersAnswer) {
  const Folder folder;
  const Ended ended = RunHalflight(folder, {"info", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  v1::GetServerInfoResponse info;
  const auto parsed = google::protobuf::util::JsonStringToMessage(ended.out, &info);
  ASSERT_TRUE(parsed.ok()) << parsed.ToString() << ended.out;
  EXPECT_EQ(info.gl_renderer(), Engine().device().gl_renderer);
  EXPECT_GT(info.limits().max_particles(), 0U);
  ExpectNothingLeft(folder);
}

TEST(Cli, InfoPrintsEveryLimit) {
  const Folder folder;
  const Ended ended = RunHalflight(folder, {"info"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  for (const char* limit : {"max_particles 50000000\n", "max_frame_seconds 600\n",
                            "max_client_frames 48\n", "max_cache_dir_bytes 0\n"}) {
    EXPECT_THAT(ended.out, HasSubstr(limit));
  }
  const google::protobuf::Descriptor& all = *v1::ServerLimits::descriptor();
  for (int i = 0; i < all.field_count(); ++i) {
    EXPECT_THAT(ended.out, HasSubstr(all.field(i)->name() + " "));
  }
}

TEST(Cli, MalformedFileIsToldByPlaceAndNothingIsStarted) {
  const Folder folder;
  const std::string whole = Contents(PlumePath("0024"));
  const std::string cut = folder.Write("cut.ply", whole.substr(0, whole.size() - 100));
  const std::string header = folder.Write("header.ply", "ply\nformat sideways 1.0\nend_header\n");
  for (const auto& [path, text] : {std::pair(cut, "byte"), std::pair(header, "line 2"),
                                   std::pair(folder / "none.ply", "No such file")}) {
    const Ended ended = RunHalflight(folder, {"render", path, "-o", folder / "f.png"});
    EXPECT_EQ(ended.code, 3) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr(path));
    EXPECT_THAT(ended.err, HasSubstr(text));
    EXPECT_FALSE(fs::exists(folder / "f.png"));
  }
  ExpectNothingLeft(folder);
}

TEST(Cli, WrongFlagsAreToldByNameAndValue) {
  const Folder folder;
  struct Case {
    std::vector<std::string> arguments;
    std::string text;
  };
  const std::string plume = PlumePath("0024");
  for (const Case& wrong :
       {Case{{}, "command: none is given"}, Case{{"render", plume}, "--output"},
        Case{{"render", plume, "-o", "f.jpeg"}, ".jpeg"},
        Case{{"render", plume, "-o", "f.png", "--size", "80"}, "--size"},
        Case{{"render", plume, "-o", "f.png", "--opacity", "1.5"}, "1.5"},
        Case{{"render", plume, "-o", "f.png", "--slices", "-4"}, "-4"},
        Case{{"render", plume, "-o", "f.png", "--light", "up"}, "up"},
        Case{{"render", plume, "-o", "f.png", "--scene", folder / "none.json"}, "none.json"},
        Case{{"render", plume, "-o", "f.png", "--server", "nowhere"}, "nowhere"},
        Case{{"render", "p.%04d.ply", "-o", "f.png", "--frames", "1-3"}, "--output"},
        Case{{"render", plume, "-o", "f.png", "--no-such-flag"}, "--no-such-flag"}}) {
    const Ended ended = RunHalflight(folder, wrong.arguments);
    EXPECT_EQ(ended.code, 2) << wrong.text << ": " << ended.err;
    EXPECT_THAT(ended.err, HasSubstr(wrong.text));
  }
  EXPECT_EQ(RunHalflight(folder, {"--help"}).code, 0);
  ExpectNothingLeft(folder);
}

TEST(Cli, RequestThatTheServerRefusesHasItsOwnExitCode) {
  const Folder folder;
  const Ended ended = RunHalflight(
      folder, {"render", PlumePath("0024"), "-o", folder / "f.png", "--size", "100000x10"});
  EXPECT_EQ(ended.code, 4) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("scene.camera.width: 100000"));
  EXPECT_FALSE(fs::exists(folder / "f.png"));
  ExpectNothingLeft(folder);
}

TEST(Cli, DeviceThatIsNotThereIsToldAndNotReplaced) {
  const Folder folder;
  const Ended ended = RunHalflight(folder, {"render", PlumePath("0024"), "-o", folder / "f.png",
                                            "--device", "drm:/dev/dri/card77"});
  EXPECT_EQ(ended.code, 5) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("/dev/dri/card77"));
  ExpectNothingLeft(folder);
}

TEST(Cli, InterruptedItEndsItsServerToo) {
  const Folder folder;
  Process process(folder, "halflight",
                  {"render", PlumePath("0040"), "-o", folder / "f.png", "--size", "1024x1024",
                   "--supersample", "8", "--slices", "50000"});
  ASSERT_TRUE(WaitFor([&] { return ProcessesWith("unix:" + folder / "tmp") == 1; }));
  process.Signal(SIGINT);
  EXPECT_EQ(process.Wait(), 130) << process.Err();
  EXPECT_FALSE(fs::exists(folder / "f.png"));
  ExpectNothingLeft(folder);
}

}  // namespace
}  // namespace halflight::loopback
