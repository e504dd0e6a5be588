#include "client/readers/npy.h"

#include <gmock/gmock.h>

#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using absl::StatusCode;
using testing::ElementsAre;

std::string Npy(int version, const std::string& dictionary, const std::string& body) {
  std::string bytes = "\x93NUMPY";
  bytes += static_cast<char>(version);
  bytes += '\0';
  bytes += version == 1 ? Bytes(static_cast<uint16_t>(dictionary.size()))
                        : Bytes(static_cast<uint32_t>(dictionary.size()));
  return bytes + dictionary + body;
}

std::string Dictionary(const std::string& descr, bool fortran, const std::string& shape) {
  return "{'descr': '" + descr + "', 'fortran_order': " + (fortran ? "True" : "False") +
         ", 'shape': " + shape + ", }          \n";
}

template <typename T>
std::string Values(std::initializer_list<T> values, std::endian order = std::endian::little) {
  std::string bytes;
  for (const T value : values) {
    bytes += Bytes(value, order);
  }
  return bytes;
}

TEST(NpyReader, ReadsPositionsInEveryVersion) {
  for (const int version : {1, 2, 3}) {
    const auto columns = ReadNpy(
        Npy(version, Dictionary("<f4", false, "(2, 3)"), Values<float>({1, 2, 3, 4, 5, 6})));
    ASSERT_TRUE(columns.ok()) << columns.status();
    EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3, 4, 5, 6));
  }
}

TEST(NpyReader, TakesAFourthColumnForTheRadius) {
  const auto columns =
      ReadNpy(Npy(1, Dictionary("<f4", false, "(1, 4)"), Values<float>({1, 2, 3, 0.5F})));
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->others[static_cast<size_t>(Attribute::kRadius)], ElementsAre(0.5F));
}

TEST(NpyReader, ReadsDoublesOfEitherByteOrder) {
  for (const auto& [descr, order] :
       {std::pair("<f8", std::endian::little), std::pair(">f8", std::endian::big)}) {
    const auto columns = ReadNpy(
        Npy(1, Dictionary(descr, false, "(1, 3)"), Values<double>({1e9 + 0.25, 2, 3}, order)));
    ASSERT_TRUE(columns.ok()) << columns.status();
    EXPECT_THAT(columns->positions, ElementsAre(1e9 + 0.25, 2, 3));
  }
}

TEST(NpyReader, ReadsFortranOrder) {
  const auto columns = ReadNpy(Npy(1, Dictionary(">f4", true, "(2, 3)"),
                                   Values<float>({1, 4, 2, 5, 3, 6}, std::endian::big)));
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(columns->positions, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(NpyReader, NamesWhereAndWhat) {
  const std::string one = Values<float>({1, 2, 3});
  ExpectError(ReadNpy("PK\x03\x04").status(), StatusCode::kInvalidArgument, {"byte 0", "NUMPY"});
  ExpectError(ReadNpy(Npy(9, Dictionary("<f4", false, "(1, 3)"), one)).status(),
              StatusCode::kInvalidArgument, {"byte 6", "version is 9"});
  ExpectError(ReadNpy(std::string("\x93NUMPY\x01\x00\xFF\xFF", 10)).status(), StatusCode::kDataLoss,
              {"byte 10", "65535"});
  ExpectError(ReadNpy(std::string("\x93NUMPY\x02\x00\x01", 9)).status(), StatusCode::kDataLoss,
              {"byte 8", "header's length"});
  ExpectError(ReadNpy(Npy(1, Dictionary("<i4", false, "(1, 3)"), one)).status(),
              StatusCode::kInvalidArgument, {"descr", "<i4", "'<f4'"});
  ExpectError(ReadNpy(Npy(1, Dictionary("<f4", false, "(1, 5)"), one)).status(),
              StatusCode::kInvalidArgument, {"shape", "1, 5", "(N, 3)"});
  ExpectError(ReadNpy(Npy(1, Dictionary("<f4", false, "(3,)"), one)).status(),
              StatusCode::kInvalidArgument, {"shape", "(N, 3)"});
  ExpectError(ReadNpy(Npy(1, Dictionary("<f4", false, "(1, 3, 1)"), one)).status(),
              StatusCode::kInvalidArgument, {"shape", "1, 3, 1"});
  ExpectError(ReadNpy(Npy(1, Dictionary("<f4", false, "(2, 3)"), one)).status(),
              StatusCode::kDataLoss, {"expected 2 rows of 12 bytes", "found 12 bytes"});
  ExpectError(ReadNpy(Npy(1, Dictionary("<f4", false, "(1, 3)"), one + "!")).status(),
              StatusCode::kInvalidArgument, {"found 1 bytes more"});
  ExpectError(ReadNpy(Npy(1, Dictionary("<f8", false, "(1000000000000000000, 3)"), one)).status(),
              StatusCode::kDataLoss, {"1000000000000000000"});
  ExpectError(ReadNpy(Npy(1, "{'descr': '<f4', 'shape': (1, 3)}", one)).status(),
              StatusCode::kInvalidArgument, {"fortran_order"});
}

}  // namespace
}  // namespace halflight::client
