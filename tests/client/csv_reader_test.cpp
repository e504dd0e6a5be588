#include "client/readers/csv.h"

#include <gmock/gmock.h>

#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using absl::StatusCode;
using testing::ElementsAre;

TEST(CsvReader, GoesByTheNamesInTheHeader) {
  const auto columns = ReadCsv("name,z,y,x,pscale\nfirst,3,2,1,0.5\nsecond,6,5,4,0.25\n");
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(columns->others[static_cast<size_t>(Attribute::kRadius)], ElementsAre(0.5F, 0.25F));
}

TEST(CsvReader, AcceptsQuotesWindowsLineEndsAndBlankLines) {
  const auto columns = ReadCsv(
      "\xEF\xBB\xBF\"X\", \"y\" ,z,\"a \"\"quoted\"\", name\"\r\n\r\n\"1\", 2 ,+3,\"a,b\"\r\n"
      "4,5,6,c");
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(CsvReader, TakesALoneRForTheRadiusAndRgbForColour) {
  const auto radius = ReadCsv("x,y,z,r\n0,0,0,0.5\n");
  ASSERT_TRUE(radius.ok()) << radius.status();
  EXPECT_THAT(radius->others[static_cast<size_t>(Attribute::kRadius)], ElementsAre(0.5F));
  const auto color = ReadCsv("x,y,z,r,g,b\n0,0,0,0.5,0.25,1\n");
  ASSERT_TRUE(color.ok()) << color.status();
  EXPECT_THAT(color->others[static_cast<size_t>(Attribute::kColor)], ElementsAre(0.5F, 0.25F, 1));
  EXPECT_TRUE(color->others[static_cast<size_t>(Attribute::kRadius)].empty());
}

TEST(CsvReader, PrefersTheBestKnownNameOfTheSameThing) {
  const auto columns = ReadCsv("pscale,radius,x,y,z\n0.5,0.25,0,0,0\n");
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->others[static_cast<size_t>(Attribute::kRadius)], ElementsAre(0.25F));
}

TEST(CsvReader, AcceptsAHeaderAlone) {
  const auto columns = ReadCsv("x,y,z\n");
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_TRUE(columns->positions.empty());
}

TEST(CsvReader, ReadsMoreParticlesThanItFirstMakesRoomFor) {
  std::string text = "x,y,z,radius\n";
  for (int i = 0; i < 1000; ++i) {
    text += std::to_string(i) + ",0,0," + std::to_string(i + 1) + "\n";
  }
  const auto columns = ReadCsv(text);
  ASSERT_TRUE(columns.ok()) << columns.status();
  ASSERT_EQ(columns->positions.size(), 3000U);
  EXPECT_EQ(columns->positions[2997], 999);
  EXPECT_EQ(columns->others[static_cast<size_t>(Attribute::kRadius)].back(), 1000);
}

TEST(CsvReader, NamesTheLineOfEveryMistake) {
  ExpectError(ReadCsv("").status(), StatusCode::kInvalidArgument, {"line 1", "names"});
  ExpectError(ReadCsv("x,y\n1,2\n").status(), StatusCode::kInvalidArgument,
              {"line 1", "missing: 'z'"});
  ExpectError(ReadCsv("x,y,z\n1,2,3\n1,2\n").status(), StatusCode::kInvalidArgument,
              {"line 3", "expected 3 fields", "found 2"});
  ExpectError(ReadCsv("x,y,z\n\n1,2,3,4\n").status(), StatusCode::kInvalidArgument,
              {"line 3", "found 4"});
  ExpectError(ReadCsv("x,y,z\n1,,3\n").status(), StatusCode::kInvalidArgument,
              {"line 2", "column 'y'", "expected a number, found ''"});
  ExpectError(ReadCsv("x,y,z\n1,2,3m\n").status(), StatusCode::kInvalidArgument,
              {"line 2", "column 'z'", "'3m'"});
  ExpectError(ReadCsv("x,y,z\n1,\"2,3\n").status(), StatusCode::kInvalidArgument,
              {"line 2", "quoted"});
}

}  // namespace
}  // namespace halflight::client
