// What log lines are made of: quotes, escapes and types, whatever the fields hold.

#include "server/log/log_event.h"

#include <cstdint>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

namespace halflight {
namespace {

using google::protobuf::Struct;
using ::testing::EndsWith;

// The line's JSON as an independent reader has it; an empty object where it is none.
Struct Read(const LogFields& fields) {
  Struct read;
  const std::string line = "{" + LogJson("frame", fields) + "}";
  const auto status = google::protobuf::util::JsonStringToMessage(line, &read);
  EXPECT_TRUE(status.ok()) << line;
  return read;
}

std::string ReadText(const std::string& text) {
  return Read({{"text", text}}).fields().at("text").string_value();
}

std::string TextOf(const std::string& text) { return LogText("e", {{"k", text}}).substr(4); }

TEST(LogEvent, TextHasQuotesOnlyWhereNeeded) {
  EXPECT_EQ(LogText("frame", {{"request_id", "shot-7"},
                              {"peer", "ipv6:%5B::1%5D:40000"},
                              {"message", "two words"},
                              {"nothing", ""},
                              {"pair", "a=b"},
                              {"frames", 3},
                              {"total_ms", 12.345678},
                              {"met", true}}),
            "frame request_id=shot-7 peer=ipv6:%5B::1%5D:40000 message=\"two words\" nothing=\"\" "
            "pair=\"a=b\" frames=3 total_ms=12.3457 met=true");
  EXPECT_EQ(LogText("stopped", {}), "stopped");
}

TEST(LogEvent, JsonHasTypes) {
  const std::string line = LogJson("frame", {{"id", "7"},
                                             {"count", 7},
                                             {"least", std::numeric_limits<int64_t>::min()},
                                             {"most", std::numeric_limits<uint64_t>::max()},
                                             {"ms", 0.25},
                                             {"met", false}});
  EXPECT_EQ(line, R"("event":"frame","id":"7","count":7,"least":-9223372036854775808,)"
                  R"("most":18446744073709551615,"ms":0.25,"met":false)");
  const Struct read = Read({{"id", "7"}, {"count", 7}, {"met", true}});
  EXPECT_EQ(read.fields().at("event").string_value(), "frame");
  EXPECT_EQ(read.fields().at("id").string_value(), "7");
  EXPECT_EQ(read.fields().at("count").number_value(), 7.0);
  EXPECT_TRUE(read.fields().at("met").bool_value());
}

TEST(LogEvent, NumbersThatJsonCannotWriteAreNull) {
  const Struct read = Read({{"infinite", std::numeric_limits<double>::infinity()},
                            {"none", std::numeric_limits<double>::quiet_NaN()},
                            {"large", 1e300}});
  EXPECT_TRUE(read.fields().at("infinite").has_null_value());
  EXPECT_TRUE(read.fields().at("none").has_null_value());
  EXPECT_EQ(read.fields().at("large").number_value(), 1e300);
}

TEST(LogEvent, AnyByteComesBackFromJson) {
  for (int byte = 0; byte < 0x80; ++byte) {
    const std::string text = {'a', static_cast<char>(byte), 'b'};
    EXPECT_EQ(ReadText(text), text) << byte;
  }
  for (const char* text : {"größe", "煙", "\xf0\x9f\x92\xa8", "\xc2\x9b", "\xe2\x80\xa8",
                           "\xef\xbf\xbd", "\\\"\\\\\"", R"(","level":"info","x":")"}) {
    EXPECT_EQ(ReadText(text), text);
  }
}

TEST(LogEvent, WhateverIsWrittenStaysOneLineWithoutControls) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) {
    all += static_cast<char>(byte);
  }
  for (const std::string& line : {LogText("e", {{"k", all}}), LogJson("e", {{"k", all}})}) {
    for (const char c : line) {
      const auto byte = static_cast<unsigned char>(c);
      EXPECT_TRUE(byte >= 0x20 && byte != 0x7f) << static_cast<int>(byte);
    }
  }
  // The terminal's escape, as the C1 control, and ends of lines that only some readers know.
  EXPECT_EQ(TextOf("\xc2\x9b\x31m"), R"("\u009b1m")");
  EXPECT_EQ(TextOf("a\xe2\x80\xa8"
                   "b\xe2\x80\xa9"),
            R"("a\u2028b\u2029")");
  EXPECT_EQ(TextOf("a\nb\tc\x1b"), R"("a\nb\u0009c\u001b")");
}

TEST(LogEvent, BytesThatAreNoUtf8AreReplaced) {
  const std::string replaced_by = "\xef\xbf\xbd";
  struct Case {
    std::string bytes;
    int replaced;
  };
  for (const Case& wrong :
       {Case{"\x80", 1}, Case{"\xff", 1}, Case{"\xc3", 1},     // alone
        Case{"\xc0\xaf", 2}, Case{"\xe0\x80\xaf", 3},          // longer than need be
        Case{"\xed\xa0\x80", 3}, Case{"\xf4\x90\x80\x80", 4},  // surrogate; above the last
        Case{"\xe7\x85", 2}, Case{"\xf0\x9f\x92", 3}, Case{"\xf5", 1}}) {
    std::string expected = "a";
    for (int i = 0; i < wrong.replaced; ++i) {
      expected += replaced_by;
    }
    EXPECT_EQ(ReadText("a" + wrong.bytes + "b"), expected + "b");
    EXPECT_EQ(TextOf("a" + wrong.bytes + "b"), "\"" + expected + "b\"");
  }
}

TEST(LogEvent, LongTextsAreCut) {
  const std::string longest(kMaxLoggedBytes, 'x');
  EXPECT_EQ(TextOf(longest), longest);
  EXPECT_EQ(TextOf(longest + "y"), "\"" + longest + "...\"");
  EXPECT_EQ(ReadText(longest + longest), longest + "...");
  // In the middle of a character: what is left of it is replaced.
  EXPECT_THAT(ReadText(std::string(kMaxLoggedBytes - 1, 'x') + "\xc3\xb6"),
              EndsWith("x\xef\xbf\xbd..."));
}

}  // namespace
}  // namespace halflight
