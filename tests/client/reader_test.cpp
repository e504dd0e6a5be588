// What all formats share: choice by extension, checks of values, the choice of an origin, raw
// files.
#include "client/readers/reader.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cmath>
#include <limits>

#include "tests/client/test_bytes.h"
#include "tests/sanitizers.h"

namespace halflight::client {
namespace {

using absl::StatusCode;
using ::testing::Each;
using ::testing::ElementsAre;

TEST(ReadParticles, ReadsTheWholePlume) {
  const auto particles = ReadParticles(HALFLIGHT_TEST_DATA "/plume/plume.0040.ply");
  ASSERT_TRUE(particles.ok()) << particles.status();
  EXPECT_EQ(particles->size(), 56000U);
  EXPECT_EQ(particles->velocities.size(), 3 * 56000U);
  EXPECT_TRUE(particles->radii.empty());
  EXPECT_THAT(particles->origin, Each(0.0));
}

TEST(ReadParticles, ChoosesTheFormatByExtensionInAnyCase) {
  const TestDirectory directory;
  const auto particles = ReadParticles(directory.Write("a.CSV", "x,y,z\n1,2,3\n4,5,6\n"));
  ASSERT_TRUE(particles.ok()) << particles.status();
  EXPECT_EQ(particles->size(), 2U);
}

TEST(ReadParticles, ReadsRawOnlyWhenAskedTo) {
  const TestDirectory directory;
  const std::string bytes = Bytes(1.0F) + Bytes(2.0F) + Bytes(3.0F) + Bytes(0.5F);
  const std::string path = directory.Write("a.f32", bytes + bytes);
  ExpectError(ReadParticles(path).status(), StatusCode::kInvalidArgument,
              {path, "'.f32'", ".ply, .csv, .npy"});
  const auto particles = ReadParticles(path, "raw");
  ASSERT_TRUE(particles.ok()) << particles.status();
  EXPECT_EQ(particles->size(), 2U);
  EXPECT_THAT(particles->radii, ElementsAre(0.5F, 0.5F));
  ExpectError(ReadParticles(directory.Write("b.raw", bytes + "123"), "raw").status(),
              StatusCode::kDataLoss, {"byte 16", "particle 1", "found 3"});
}

TEST(ReadParticles, NamesTheFileThatItCannotOpen) {
  ExpectError(ReadParticles("/nowhere/a.ply").status(), StatusCode::kNotFound, {"/nowhere/a.ply"});
  const TestDirectory directory;
  std::filesystem::create_directory(directory / "d.ply");
  ExpectError(ReadParticles(directory / "d.ply").status(), StatusCode::kInvalidArgument,
              {"directory"});
  ExpectError(ReadParticles("a.ply", "obj").status(), StatusCode::kInvalidArgument,
              {"'obj'", "ply, csv, npy, raw"});
}

TEST(ReadParticles, NamesTheFileThatDoesNotFitIntoMemory) {
  if (testing::kSanitized) GTEST_SKIP() << "they end a process that asks for so much";
  const TestDirectory directory;
  const std::string path = directory.Write("a.csv", "x,y,z\n");
  struct rlimit before {};
  getrlimit(RLIMIT_AS, &before);
  const struct rlimit little { rlim_t{1} << 30, before.rlim_max };
  std::filesystem::resize_file(path, std::uintmax_t{1} << 33);  // a hole
  setrlimit(RLIMIT_AS, &little);
  const absl::Status status = ReadParticles(path).status();
  setrlimit(RLIMIT_AS, &before);
  ExpectError(status, StatusCode::kResourceExhausted, {path, "memory"});
}

TEST(ReadParticles, NamesTheParticleWhoseValueIsImpossible) {
  const TestDirectory directory;
  struct Case {
    const char* text;
    std::vector<std::string> message;
  };
  for (const Case& bad : {
           Case{"x,y,z\n0,0,0\n0,nan,0\n", {"particle 1", "position.y is nan", "[-1e17, 1e17]"}},
           Case{"x,y,z\n0,0,-inf\n", {"particle 0", "position.z is -inf"}},
           Case{"x,y,z,radius\n0,0,0,1\n0,0,0,-2\n",
                {"particle 1", "radius is -2", "[1e-15, 1e17]"}},
           Case{"x,y,z,radius\n0,0,0,0\n", {"particle 0", "radius is 0"}},
           Case{"x,y,z,radius\n0,0,0,nan\n", {"particle 0", "radius is nan"}},
           Case{"x,y,z,opacity\n0,0,0,1.5\n", {"particle 0", "opacity is 1.5", "[0, 1]"}},
           Case{"x,y,z,r,g,b\n0,0,0,1,-1,0\n", {"particle 0", "color.g is -1", ">= 0"}},
           Case{"x,y,z,vx,vy,vz\n0,0,0,1,2,1e300\n", {"particle 0", "velocity.z is inf"}},
           Case{"x,y,\xff\n1,2,3\n", {"missing: 'z'", "found: 'x', 'y', '?'"}},
           Case{"x,y,z\n3e38,0,0\n-3e38,1,1\n", {"particle 0", "position.x is 3e+38"}},
           Case{"x,y,z,radius\n0,0,0,1e20\n", {"particle 0", "radius is 1"}},
           Case{"x,y,z\n1e300,0,0\n-1e300,0,0\n",
                {"particle 0", "position.x is 1e+300", "[-1e17, 1e17]"}},
       }) {
    ExpectError(ReadParticles(directory.Write("a.csv", bad.text)).status(),
                StatusCode::kInvalidArgument, bad.message);
  }
}

TEST(ReadParticles, KeepsTheOffsetsOfLargeCoordinates) {
  const TestDirectory directory;
  const auto near = ReadParticles(directory.Write("near.csv", "x,y,z\n0.25,0,0\n1,2,3.125\n"));
  const auto far = ReadParticles(
      directory.Write("far.csv", "x,y,z\n10000000.25,-20000000,0\n10000001,-19999998,3.125\n"));
  ASSERT_TRUE(near.ok() && far.ok()) << near.status() << far.status();
  EXPECT_THAT(near->origin, Each(0.0));
  ASSERT_EQ(far->size(), 2U);
  for (size_t i = 0; i < 6; ++i) {
    const double shift = std::array{1e7, -2e7, 0.0}[i % 3];
    // Exact, though the coordinates themselves do not fit into 32 bits.
    EXPECT_EQ(far->origin[i % 3] + far->positions[i], shift + near->positions[i]) << i;
  }
}

TEST(ReadParticles, KeepsASingleFarParticleExactly) {
  const TestDirectory directory;
  const auto particles = ReadParticles(directory.Write("a.csv", "x,y,z\n10000000.1,0,7\n"));
  ASSERT_TRUE(particles.ok()) << particles.status();
  EXPECT_EQ(particles->origin[0] + particles->positions[0], 10000000.1);
}

TEST(ReadParticles, KeepsTheOriginToWhatServersTake) {
  const TestDirectory directory;
  const auto particles =
      ReadParticles(directory.Write("a.csv", "x,y,z\n1e17,0,0\n99999999999999000,0,0\n"));
  ASSERT_TRUE(particles.ok()) << particles.status();
  EXPECT_LE(particles->origin[0], 1e17);
}

TEST(ReadParticles, AcceptsAFileWithoutParticles) {
  const TestDirectory directory;
  const auto particles = ReadParticles(directory.Write("a.csv", "x,y,z,radius\n"));
  ASSERT_TRUE(particles.ok()) << particles.status();
  EXPECT_EQ(particles->size(), 0U);
}

}  // namespace
}  // namespace halflight::client
