// Sequences of the plume through the programs: every frame, in order, as it would be alone.

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/encode/decoded.h"
#include "tests/process/process.h"

namespace halflight::loopback {
namespace {

namespace fs = std::filesystem;
using testing::Contents;
using testing::Ended;
using testing::Folder;
using ::testing::HasSubstr;
using testing::PlumePath;
using testing::Process;
using testing::RunHalflight;

// Fixed settings, so that frames alone are made as those of a sequence.
std::vector<std::string> Fixed(std::vector<std::string> arguments) {
  for (const char* argument :
       {"--size", "60x80", "--slices", "8", "--light-buffer", "64", "--radius", "0.045", "--eye",
        "0.5,1.5,4.6", "--target", "0,1.25,0", "--light", "1,-1,-1"}) {
    arguments.emplace_back(argument);
  }
  return arguments;
}

std::string Pattern() { return PlumePath("%04d"); }

TEST(SequenceProcess, RendersEveryFrameOfAPatternAsItWouldAlone) {
  const Folder folder;
  const Ended ended = RunHalflight(
      folder, Fixed({"render", Pattern(), "--frames", "24-40x8", "-o", folder / "out/f.%04d.exr",
                     "-o", "coverage=" + folder / "out/c.%d.png"}));
  ASSERT_EQ(ended.code, 0) << ended.err;
  size_t last = 0;
  for (const std::string frame : {"0024", "0032", "0040"}) {
    const std::string path = folder / ("out/f." + frame + ".exr");
    ASSERT_TRUE(fs::exists(path)) << ended.out;
    EXPECT_TRUE(fs::exists(folder / ("out/c." + frame.substr(2) + ".png")));
    const size_t told = ended.out.find(path);
    ASSERT_NE(told, std::string::npos);
    EXPECT_GE(told, last) << "told in order";
    last = told;
    const Ended alone =
        RunHalflight(folder, Fixed({"render", PlumePath(frame), "-o", folder / "alone.exr"}));
    ASSERT_EQ(alone.code, 0) << alone.err;
    EXPECT_EQ(Contents(path), Contents(folder / "alone.exr"));
  }
  EXPECT_NE(Contents(folder / "out/f.0024.exr"), Contents(folder / "out/f.0040.exr"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "out"), {}), 6);
  EXPECT_EQ(ended.err, "") << "no progress bar where nobody looks";
}

TEST(SequenceProcess, ThreeCommandsShareOneServer) {
  const Folder folder;
  const std::string address = "unix:" + folder / "socket";
  Process server(folder, "halflightd", {"--address", address});
  ASSERT_EQ(server.Address(), address);
  std::vector<std::string> outputs;
  {
    std::vector<std::unique_ptr<Process>> clients;
    for (int i = 0; i < 3; ++i) {
      outputs.push_back(folder / ("f." + std::to_string(i) + ".%d.raw"));
      clients.push_back(
          std::make_unique<Process>(folder, "halflight",
                                    Fixed({"render", Pattern(), "--frames", "24,32,40", "--server",
                                           address, "--json", "-o", outputs.back()})));
    }
    for (const auto& client : clients) {
      EXPECT_EQ(client->Wait(), 0) << client->Err();
      const std::string out = client->Out();
      EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 3) << "one line a frame";
    }
  }
  for (const char* frame : {"24", "32", "40"}) {
    const auto bytes = [&](int i) {
      return Contents(folder / ("f." + std::to_string(i) + "." + frame + ".raw"));
    };
    EXPECT_EQ(bytes(0).size(), 60U * 80U * 16U);
    EXPECT_EQ(bytes(1), bytes(0));
    EXPECT_EQ(bytes(2), bytes(0));
  }
}

TEST(SequenceProcess, MissingFrameIsToldBeforeAnythingIsRendered) {
  const Folder folder;
  const Ended ended = RunHalflight(
      folder, Fixed({"render", Pattern(), "--frames", "24-26", "-o", folder / "f.%04d.png"}));
  EXPECT_EQ(ended.code, 3) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("plume.0025.ply"));
  EXPECT_THAT(ended.err, HasSubstr("2 of 3"));
  EXPECT_FALSE(fs::exists(folder / "f.0024.png"));
}

TEST(SequenceProcess, MalformedFrameInTheMiddleKeepsThoseBefore) {
  const Folder folder;
  const std::string whole = Contents(PlumePath("0024"));
  for (const int frame : {1, 2, 4}) {
    EXPECT_NE(folder.Write("p." + std::to_string(frame) + ".ply", whole), "");
  }
  const std::string bad = folder.Write("p.3.ply", whole.substr(0, 5000));
  const Ended ended = RunHalflight(
      folder, Fixed({"render", folder / "p.%d.ply", "--frames", "1-4", "-o", folder / "f.%d.exr"}));
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr(bad));
  EXPECT_TRUE(fs::exists(folder / "f.1.exr"));
  EXPECT_EQ(Contents(folder / "f.2.exr"), Contents(folder / "f.1.exr"));
  EXPECT_FALSE(fs::exists(folder / "f.3.exr"));
  EXPECT_FALSE(fs::exists(folder / "f.4.exr"));
}

}  // namespace
}  // namespace halflight::loopback
