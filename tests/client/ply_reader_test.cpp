#include "client/readers/ply.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using absl::StatusCode;
using testing::ElementsAre;
using testing::FloatEq;
using testing::FloatNear;

const std::vector<float>& Other(const Columns& columns, Attribute attribute) {
  return columns.others[static_cast<size_t>(attribute)];
}

TEST(PlyReader, ReadsAscii) {
  const auto columns = ReadPly(
      "ply\nformat ascii 1.0\ncomment any\nelement vertex 2\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2 3\n4 5e-1 -6\n");
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3, 4, 0.5, -6));
}

TEST(PlyReader, AcceptsPropertiesInAnyOrder) {
  const auto columns = ReadPly(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float vz\nproperty float z\n"
      "property float radius\nproperty float vx\nproperty float x\nproperty float age\n"
      "property float vy\nproperty float y\nend_header\n9 3 0.5 7 1 99 8 2\n");
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3));
  EXPECT_THAT(Other(*columns, Attribute::kVelocity), ElementsAre(7, 8, 9));
  EXPECT_THAT(Other(*columns, Attribute::kRadius), ElementsAre(0.5F));
  EXPECT_TRUE(Other(*columns, Attribute::kOpacity).empty());
}

struct BinaryCase {
  const char* name;
  const char* format;
  std::endian order;
};

class PlyReaderBinary : public testing::TestWithParam<BinaryCase> {};

TEST_P(PlyReaderBinary, ReadsEveryScalarType) {
  const std::endian order = GetParam().order;
  const std::string header = std::string("ply\nformat ") + GetParam().format +
                             " 1.0\nelement vertex 1\nproperty double x\nproperty int16 y\n"
                             "property uint z\nproperty char vx\nproperty uint8 vy\n"
                             "property ushort vz\nproperty float32 radius\nproperty int a\n"
                             "end_header\n";
  const auto columns = ReadPly(header + Bytes(1e9 + 0.125, order) + Bytes<int16_t>(-300, order) +
                               Bytes<uint32_t>(4000000000U, order) + Bytes<int8_t>(-5, order) +
                               Bytes<uint8_t>(200, order) + Bytes<uint16_t>(60000, order) +
                               Bytes(0.25F, order) + Bytes<int32_t>(-7, order));
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1e9 + 0.125, -300, 4e9));
  EXPECT_THAT(Other(*columns, Attribute::kVelocity), ElementsAre(-5, 200, 60000));
  EXPECT_THAT(Other(*columns, Attribute::kRadius), ElementsAre(0.25F));
}

TEST_P(PlyReaderBinary, SkipsListsAndElementsBeforeTheVertices) {
  const std::endian order = GetParam().order;
  const std::string header = std::string("ply\nformat ") + GetParam().format +
                             " 1.0\nelement face 2\nproperty list uchar int vertex_indices\n"
                             "property float weight\nelement vertex 1\nproperty float x\n"
                             "property list ushort double extra\nproperty float y\n"
                             "property float z\nend_header\n";
  const std::string faces = Bytes<uint8_t>(3, order) + Bytes<int32_t>(0, order) +
                            Bytes<int32_t>(1, order) + Bytes<int32_t>(2, order) +
                            Bytes(1.0F, order) + Bytes<uint8_t>(0, order) + Bytes(2.0F, order);
  const std::string vertex = Bytes(1.0F, order) + Bytes<uint16_t>(2, order) + Bytes(9.0, order) +
                             Bytes(9.0, order) + Bytes(2.0F, order) + Bytes(3.0F, order);
  const auto columns = ReadPly(header + faces + vertex);
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3));
}

INSTANTIATE_TEST_SUITE_P(Orders, PlyReaderBinary,
                         testing::Values(BinaryCase{"Little", "binary_little_endian",
                                                    std::endian::little},
                                         BinaryCase{"Big", "binary_big_endian", std::endian::big}),
                         [](const auto& test) { return test.param.name; });

TEST(PlyReader, TakesIntegerColoursAsSrgbAndFloatOnesAsLinear) {
  const auto bytes = ReadPly(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property uchar alpha\nend_header\n0 0 0 255 188 0 51\n");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_THAT(Other(*bytes, Attribute::kColor),
              ElementsAre(FloatEq(1), FloatNear(0.5029F, 1e-4F), FloatEq(0)));
  EXPECT_THAT(Other(*bytes, Attribute::kOpacity), ElementsAre(FloatEq(0.2F)));
  const auto floats = ReadPly(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nproperty float r\nproperty float g\nproperty float b\nend_header\n"
      "0 0 0 1.5 0.5 0\n");
  ASSERT_TRUE(floats.ok()) << floats.status();
  EXPECT_THAT(Other(*floats, Attribute::kColor), ElementsAre(1.5F, 0.5F, 0));
}

TEST(PlyReader, AcceptsWindowsLineEnds) {
  const auto columns = ReadPly(
      "ply\r\nformat binary_little_endian 1.0\r\nelement vertex 1\r\nproperty float x\r\n"
      "property float y\r\nproperty float z\r\nend_header\r\n" +
      Bytes(1.0F) + Bytes(2.0F) + Bytes(3.0F));
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3));
}

TEST(PlyReader, AcceptsAFileWithoutParticles) {
  const auto columns = ReadPly(
      "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n");
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_TRUE(columns->positions.empty());
}

struct BadPly {
  const char* name;
  std::string bytes;
  StatusCode code;
  std::vector<std::string> message;
};

class PlyReaderRefuses : public testing::TestWithParam<BadPly> {};

TEST_P(PlyReaderRefuses, NamesWhereAndWhat) {
  ExpectError(ReadPly(GetParam().bytes).status(), GetParam().code, GetParam().message);
}

const std::string kXyz = "property float x\nproperty float y\nproperty float z\nend_header\n";
const std::string kAscii = "ply\nformat ascii 1.0\n";
const std::string kBinary = "ply\nformat binary_little_endian 1.0\n";

INSTANTIATE_TEST_SUITE_P(
    Files, PlyReaderRefuses,
    testing::Values(
        BadPly{"Empty", "", StatusCode::kInvalidArgument, {"line 1", "expected 'ply'"}},
        BadPly{"NoPly", "solid x\n", StatusCode::kInvalidArgument, {"line 1", "'solid x'"}},
        BadPly{"NoEndOfHeader",
               kAscii + "element vertex 1\n",
               StatusCode::kDataLoss,
               {"line 3", "expected 'end_header'"}},
        BadPly{"UnknownEncoding",
               "ply\nformat xml 1.0\n",
               StatusCode::kInvalidArgument,
               {"line 2", "'xml'", "ascii, binary_little_endian, binary_big_endian"}},
        BadPly{"UnknownVersion",
               "ply\nformat ascii 2.0\n",
               StatusCode::kInvalidArgument,
               {"line 2", "'2.0'", "allowed: 1.0"}},
        BadPly{"NoFormat",
               "ply\nelement vertex 0\n" + kXyz,
               StatusCode::kInvalidArgument,
               {"line 6", "'format'"}},
        BadPly{"UnknownKeyword",
               kAscii + "elements vertex 1\n",
               StatusCode::kInvalidArgument,
               {"line 3", "'elements'"}},
        BadPly{"UnknownType",
               kAscii + "element vertex 1\nproperty half x\n",
               StatusCode::kInvalidArgument,
               {"line 4", "'half'"}},
        BadPly{"CountIsNoNumber",
               kAscii + "element vertex -1\n" + kXyz,
               StatusCode::kInvalidArgument,
               {"line 3", "'-1'"}},
        BadPly{"PropertyWithoutElement",
               kAscii + "property float x\n",
               StatusCode::kInvalidArgument,
               {"line 3"}},
        BadPly{"PropertyTwice",
               kAscii + "element vertex 1\nproperty float x\nproperty int x\n",
               StatusCode::kInvalidArgument,
               {"line 5", "'x' twice"}},
        BadPly{"NoVertices",
               kAscii + "element face 0\n" + kXyz,
               StatusCode::kInvalidArgument,
               {"'vertex'"}},
        BadPly{"NoZ",
               kAscii + "element vertex 0\nproperty float x\nproperty float y\nend_header\n",
               StatusCode::kInvalidArgument,
               {"missing: 'z'", "found: 'x', 'y'"}},
        BadPly{"HalfAVelocity",
               kAscii + "element vertex 0\nproperty float vx\n" + kXyz,
               StatusCode::kInvalidArgument,
               {"velocity", "missing: 'vy', 'vz'"}},
        BadPly{"TooFewLines",
               kAscii + "element vertex 2\n" + kXyz + "1000 2000 3000\n",
               StatusCode::kDataLoss,
               {"line 9", "vertex 1 of 2", "end of the file"}},
        BadPly{"TooFewValues",
               kAscii + "element vertex 1\n" + kXyz + "1000 2000\n",
               StatusCode::kInvalidArgument,
               {"line 8", "'z'", "the end of the line"}},
        BadPly{"TooManyValues",
               kAscii + "element vertex 1\n" + kXyz + "1 2 3 4\n",
               StatusCode::kInvalidArgument,
               {"line 8", "expected 3 values", "'4'"}},
        BadPly{"NoNumber",
               kAscii + "element vertex 1\n" + kXyz + "1 two 3\n",
               StatusCode::kInvalidArgument,
               {"line 8", "vertex 0", "'y'", "'two'"}},
        BadPly{"Truncated",
               kBinary + "element vertex 2\n" + kXyz + std::string(20, '\0'),
               StatusCode::kDataLoss,
               {"byte 115", "expected 2 x 'vertex'", "found 20 bytes"}},
        BadPly{"HugeCount",
               kBinary + "element vertex 1000000000000000\n" + kXyz,
               StatusCode::kDataLoss,
               {"1000000000000000", "found 0 bytes"}},
        BadPly{"HugeAsciiCount",
               kAscii + "element vertex 18446744073709551615\n" + kXyz + "1 2 3",
               StatusCode::kDataLoss,
               {"18446744073709551615"}},
        BadPly{"ListPastTheEnd",
               kBinary + "element face 1\nproperty list uint double i\nelement vertex 0\n" + kXyz +
                   Bytes<uint32_t>(0xFFFFFFFFU),
               StatusCode::kDataLoss,
               {"face 0", "'i'"}},
        BadPly{"NegativeList",
               kBinary + "element face 1\nproperty list char uchar i\nelement vertex 0\n" + kXyz +
                   "\xFE",
               StatusCode::kInvalidArgument,
               {"face 0", "length is -2"}}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace halflight::client
