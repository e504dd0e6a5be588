// Names of calls.

#include "server/request_id.h"

#include <gtest/gtest.h>

namespace halflight {
namespace {

TEST(RequestId, IsPrintableAndBounded) {
  EXPECT_TRUE(IsRequestId("shot 7"));
  EXPECT_TRUE(IsRequestId(std::string(kMaxRequestIdBytes, 'a')));
  EXPECT_FALSE(IsRequestId(std::string(kMaxRequestIdBytes + 1, 'a')));
  EXPECT_FALSE(IsRequestId(""));
  for (const char* bad : {"a\nb", "\x7f", "\x1b[1m", "\xc3\xb6"}) {
    EXPECT_FALSE(IsRequestId(bad));
  }
}

TEST(RequestId, ThatIsMadeIsOneAndDiffers) {
  const std::string first = MakeRequestId();
  EXPECT_TRUE(IsRequestId(first));
  EXPECT_NE(first, MakeRequestId());
}

}  // namespace
}  // namespace halflight
