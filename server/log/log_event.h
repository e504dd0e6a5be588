// One thing that happened, as the log tells it: a name and typed fields, written as key=value for
// people or as JSON for programs. Writes nothing itself.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace halflight {

// Of a field's text no more is written: what clients write is as long as they like.
inline constexpr size_t kMaxLoggedBytes = 2048;

// A key, which is ours (letters, digits and '_'), and a value, which may be anybody's.
class LogField {
 public:
  using Value = std::variant<bool, int64_t, uint64_t, double, std::string>;

  LogField(std::string key, std::string text) : key_(std::move(key)), value_(std::move(text)) {}
  LogField(std::string key, const char* text) : key_(std::move(key)), value_(std::string(text)) {}
  LogField(std::string key, double number) : key_(std::move(key)), value_(number) {}
  template <std::integral T>
  LogField(std::string key, T number) : key_(std::move(key)), value_(Integer(number)) {}

  [[nodiscard]] const std::string& key() const { return key_; }
  [[nodiscard]] const Value& value() const { return value_; }

 private:
  template <typename T>
  static Value Integer(T number) {
    if constexpr (std::same_as<T, bool>) {
      return number;
    } else if constexpr (std::signed_integral<T>) {
      return static_cast<int64_t>(number);
    } else {
      return static_cast<uint64_t>(number);
    }
  }

  std::string key_;
  Value value_;
};

using LogFields = std::vector<LogField>;

// Both are one line of printable UTF-8, whatever the fields hold: bytes that are no UTF-8 become
// U+FFFD, control characters escapes of JSON, and long texts are cut.

// frame request_id=a message="two words" total_ms=12.5: with quotes where the text has blanks,
// quotes or the like.
std::string LogText(std::string_view event, const LogFields& fields);

// "event":"frame","request_id":"a","total_ms":12.5: the members of an object, without its braces.
// Numbers that JSON cannot write are null.
std::string LogJson(std::string_view event, const LogFields& fields);

}  // namespace halflight
