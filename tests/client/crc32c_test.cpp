// The checksum of outputs against the published values, in pieces as it arrives, both ways of
// computing it.
#include "halflight/crc32c.h"

#include <string>

#include <gtest/gtest.h>

namespace halflight {
namespace {

TEST(Crc32c, IsThePublishedOne) {
  // RFC 3720, appendix B.4, and the check value that catalogues of CRCs list.
  std::string ascending;
  for (int byte = 0; byte < 32; ++byte) ascending += static_cast<char>(byte);
  for (const auto extend : {ExtendCrc32c, ExtendCrc32cPortably}) {
    EXPECT_EQ(extend(0, ""), 0U);
    EXPECT_EQ(extend(0, "123456789"), 0xE3069283U);
    EXPECT_EQ(extend(0, std::string(32, '\0')), 0x8A9136AAU);
    EXPECT_EQ(extend(0, std::string(32, '\xFF')), 0x62A8AB43U);
    EXPECT_EQ(extend(0, ascending), 0x46DD794EU);
  }
}

TEST(Crc32c, DoesNotDependOnWhereBytesAreCutNorOnTheMachine) {
  std::string bytes;
  for (uint32_t i = 0; i < 40000; ++i) bytes += static_cast<char>((i * 2654435761U) >> 24U);
  const uint32_t whole = ExtendCrc32cPortably(0, bytes);
  for (size_t cut = 0; cut <= bytes.size(); cut += 371) {
    const std::string_view first = std::string_view(bytes).substr(0, cut);
    const std::string_view second = std::string_view(bytes).substr(cut);
    EXPECT_EQ(ExtendCrc32c(ExtendCrc32c(0, first), second), whole) << cut;
  }
}

TEST(Crc32c, ChangesWithEveryBit) {
  std::string bytes(100, 'x');
  const uint32_t before = ExtendCrc32c(0, bytes);
  for (char& byte : bytes) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      byte = static_cast<char>(byte ^ (1U << bit));
      EXPECT_NE(ExtendCrc32c(0, bytes), before);
      byte = static_cast<char>(byte ^ (1U << bit));
    }
  }
}

}  // namespace
}  // namespace halflight
