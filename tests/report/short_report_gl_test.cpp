// The short form of the report, made and looked over; and what becomes of it where something is
// broken. No figure of it is judged: its frames are small and few.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "absl/strings/str_replace.h"
#include "tests/report/check.h"
#include "tests/report/report.h"
#include "tests/report/scenes.h"
#include "tests/report/settings.h"

namespace halflight::report {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

namespace fs = std::filesystem;

ReportOptions ShortForm(const std::string& out) {
  return {.data_folder = HALFLIGHT_TEST_DATA,
          .out_folder = out,
          .short_form = true,
          .repeats = 2,
          .version = "0",
          .command = "./dev report --short"};
}

std::string Read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void Write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

class ShortReport : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "halflight-report-XXXXXX";
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  // A path in a folder of this test's own.
  [[nodiscard]] std::string At(const std::string& name) const { return folder_ + "/" + name; }

 private:
  std::string folder_;
};

TEST_F(ShortReport, IsWholeAndItsFaultsAreSeen) {
  const absl::Status status = MakeReport(ShortForm(At("report")));
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_THAT(FaultsOf(At("report")), IsEmpty());

  // It has every scene and setting of the tables, and says what to use.
  const std::string table = Read(At("report/measurements.csv"));
  const std::string page = Read(At("report/README.md"));
  const auto scenes = LoadScenes({HALFLIGHT_TEST_DATA, true});
  ASSERT_TRUE(scenes.ok()) << scenes.status();
  for (const ReportScene& scene : *scenes) EXPECT_THAT(table, HasSubstr(scene.name + ","));
  for (const Setting& setting : ListSettings(true)) {
    EXPECT_THAT(table, HasSubstr("," + setting.name + ","));
  }
  for (const char* text : {"## What to use", "GL renderer: ", "`--technique", "./dev report"}) {
    EXPECT_THAT(page, HasSubstr(text));
  }
  // The reference draws what errors are measured against: nothing but rounding is left.
  for (const CsvRow& row : ReadCsv(table)) {
    if (row.at("setting") == "reference") {
      EXPECT_LT(std::stod(row.at("rmse")), 1e-6);
    }
  }

  // One fault after the other, each put right again.
  const auto faults_with = [&](const std::string& file, const std::string& bytes) {
    const std::string path = At("report/" + file);
    const std::string right = Read(path);
    EXPECT_NE(right, bytes) << file << " did not change";
    Write(path, bytes);
    std::vector<std::string> faults = FaultsOf(At("report"));
    Write(path, right);
    return faults;
  };
  const std::string swapped = absl::StrReplaceAll(table, {{",1\n", ",0\n"}, {",0\n", ",1\n"}});
  EXPECT_THAT(faults_with("measurements.csv", swapped), Contains(HasSubstr("is beaten")));
  EXPECT_THAT(faults_with("measurements.csv", table + "plume,\n"), Contains(HasSubstr("table")));
  EXPECT_THAT(faults_with("README.md", absl::StrReplaceAll(page, {{"plume40-thin-back", ""}})),
              Contains("page: does not name plume40-thin-back"));
  EXPECT_THAT(faults_with("README.md", page + "![](gone.svg)"), Contains(HasSubstr("gone.svg")));
  const std::string plot = Read(At("report/scaling.svg"));
  EXPECT_THAT(faults_with("scaling.svg", plot.substr(0, plot.size() / 2)),
              Contains("scaling.svg: not well-formed"));
  EXPECT_THAT(faults_with("plume40-thin-back-exact.png", "no picture"), Not(IsEmpty()));
}

TEST_F(ShortReport, OfAnEmptyFolderIsFaulty) { EXPECT_THAT(FaultsOf(At("")), Not(IsEmpty())); }

TEST_F(ShortReport, NamesParticlesThatCannotBeRead) {
  ReportOptions options = ShortForm(At("report"));
  options.data_folder = At("data");
  fs::create_directories(At("data/plume"));
  Write(At("data/plume/plume.0024.ply"), "ply\nformat ascii 1.0\nend_header\n");
  const absl::Status status = MakeReport(options);
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("plume.0024.ply"));
  EXPECT_FALSE(fs::exists(At("report/README.md")));
}

TEST_F(ShortReport, NamesAFolderThatCannotBeMade) {
  Write(At("file"), "");
  const absl::Status status = MakeReport(ShortForm(At("file/report")));
  EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(status.message()), HasSubstr("file/report"));
}

TEST_F(ShortReport, NamesADeviceThatIsNotThere) {
  ReportOptions options = ShortForm(At("report"));
  options.device = "drm:/dev/dri/none";
  EXPECT_FALSE(MakeReport(options).ok());
}

}  // namespace
}  // namespace halflight::report
