// The file of tokens: whose each is, and what is not taken for such a file.

#include "server/access/token_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "halflight/sha256.h"

namespace halflight {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string Line(const std::string& token, const std::string& tenant) {
  return ToHex(Sha256Of(token)) + " " + tenant + "\n";
}

std::string ErrorOf(const std::string& text) {
  const auto table = TokenTable::Parse(text);
  EXPECT_EQ(table.status().code(), absl::StatusCode::kInvalidArgument) << text;
  return std::string(table.status().message());
}

TEST(TokenTable, KnowsWhoseEachTokenIs) {
  const auto table = TokenTable::Parse("# who may call\n\n" + Line("open sesame", "ali") +
                                       Line("xyzzy", "adventure") + "\t\r\n");
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_EQ(table->TenantOf("open sesame"), "ali");
  EXPECT_EQ(table->TenantOf("xyzzy"), "adventure");
  EXPECT_EQ(table->TenantOf("xyzz"), std::nullopt);
  EXPECT_EQ(table->TenantOf(""), std::nullopt);
  // What stands in the file is no token.
  EXPECT_EQ(table->TenantOf(ToHex(Sha256Of("xyzzy"))), std::nullopt);
}

TEST(TokenTable, NamesTheLineThatIsWrongAndRepeatsNoneOfIt) {
  const std::string good = Line("a", "one");
  EXPECT_THAT(ErrorOf(good + "secret two\n"), HasSubstr("line 2"));
  EXPECT_THAT(ErrorOf(good + "secret two\n"), Not(HasSubstr("secret")));
  EXPECT_THAT(ErrorOf(Line("b", "")), HasSubstr("line 1: what follows"));
  EXPECT_THAT(ErrorOf(Line("b", "two words")), HasSubstr("line 1: what follows"));
  EXPECT_THAT(ErrorOf(Line("b", std::string(129, 'x'))), HasSubstr("line 1: what follows"));
  EXPECT_THAT(ErrorOf(Line("b", "caf\xc3\xa9")), HasSubstr("line 1: what follows"));
  EXPECT_THAT(ErrorOf(good + Line("a", "two")), HasSubstr("line 2: the token stands"));
}

TEST(TokenTable, TakesNoFileThatMayBeHalfWritten) {
  std::string text = Line("a", "one") + Line("b", "alice");
  for (size_t size = text.size() - 1; size > text.size() / 2; --size) {
    EXPECT_FALSE(TokenTable::Parse(text.substr(0, size)).ok()) << text.substr(0, size);
  }
  EXPECT_THAT(ErrorOf(""), HasSubstr("no token"));
  EXPECT_THAT(ErrorOf("# nobody\n"), HasSubstr("no token"));
}

}  // namespace
}  // namespace halflight
