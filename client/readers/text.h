// Numbers and lines of text files, for the readers. Knows nothing of any format.
#pragma once

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace halflight::client {

// Without white space, tabs and carriage returns at both ends.
inline std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  const size_t first = text.find_first_not_of(kSpace);
  return first == std::string_view::npos
             ? std::string_view()
             : text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

// The whole of `text` as a decimal number; also nan and inf, which the checks of values name.
inline std::optional<double> ParseNumber(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') {
    text.remove_prefix(1);
  }
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) {
    return std::nullopt;
  }
  // Too large or too small for from_chars to say: strtod gives infinity or the nearest to zero.
  return error == std::errc() ? value : std::strtod(std::string(text).c_str(), nullptr);
}

// The whole of `text` as a count, >= 0.
inline std::optional<uint64_t> ParseCount(std::string_view text) {
  uint64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return stop == end && error == std::errc() && !text.empty() ? std::optional(value) : std::nullopt;
}

// At most 40 characters of `text`, printable, for messages.
inline std::string Excerpt(std::string_view text) {
  std::string excerpt(text.substr(0, 40));
  for (char& c : excerpt) {
    c = std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  }
  return text.size() > 40 ? excerpt + "..." : excerpt;
}

// The lines of a text, one after the other, counted from 1.
class LineReader {
 public:
  explicit LineReader(std::string_view text, size_t first_line = 1)
      : text_(text), next_line_(first_line) {}

  // The next line without its end (\n or \r\n); none at the end of the text.
  std::optional<std::string_view> Next() {
    if (offset_ >= text_.size()) {
      return std::nullopt;
    }
    const size_t end = std::min(text_.find('\n', offset_), text_.size());
    std::string_view line = text_.substr(offset_, end - offset_);
    offset_ = end + 1;
    ++next_line_;
    if (!line.empty() && line.back() == '\r') {
      line.remove_suffix(1);
    }
    return line;
  }
  // The number of the line that Next() returned last.
  [[nodiscard]] size_t line_number() const { return next_line_ - 1; }
  // Where the next line starts.
  [[nodiscard]] size_t offset() const { return std::min(offset_, text_.size()); }

 private:
  std::string_view text_;
  size_t offset_ = 0;
  size_t next_line_;
};

// The words of a line, one after the other.
class WordReader {
 public:
  explicit WordReader(std::string_view line) : rest_(line) {}

  // The next word; empty at the end of the line.
  std::string_view Next() {
    constexpr std::string_view kSpace = " \t\r";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kSpace), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kSpace));
    rest_.remove_prefix(word.size());
    return word;
  }

 private:
  std::string_view rest_;
};

}  // namespace halflight::client
