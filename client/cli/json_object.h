// Writes JSON objects. Reads none, and needs no library.
#pragma once

#include <array>
#include <charconv>
#include <string>
#include <string_view>

namespace halflight::client {

inline std::string JsonString(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string json = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      json += '\\';
      json += c;
    } else if (code < 0x20) {
      json += "\\u00";
      json += kDigits[code >> 4U];
      json += kDigits[code & 0xFU];
    } else {
      json += c;
    }
  }
  return json + '"';
}

// The shortest text that reads as the same number, which is finite.
template <typename Number>
std::string JsonNumber(Number number) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

// Members in the order in which they are added.
class JsonObject {
 public:
  // `json` is a value as it is written: an object, an array.
  void AddJson(std::string_view name, std::string_view json) {
    if (!members_.empty()) members_ += ',';
    members_.append(JsonString(name)).append(":").append(json);
  }
  void Add(std::string_view name, std::string_view text) { AddJson(name, JsonString(text)); }
  template <typename Number>
  void AddNumber(std::string_view name, Number number) {
    AddJson(name, JsonNumber(number));
  }
  [[nodiscard]] std::string Text() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

}  // namespace halflight::client
