#include "client/cli/frame_pattern.h"

#include <fmt/format.h>

#include <optional>

namespace halflight::client {

namespace {

// The expanded pattern, and how many numbers are in it; none where a % means nothing.
struct Expansion {
  std::string text;
  int numbers = 0;
};

std::optional<Expansion> Expand(const std::string& pattern, int64_t frame) {
  Expansion expansion;
  for (size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] != '%') {
      expansion.text += pattern[i];
      continue;
    }
    size_t at = i + 1;
    if (at < pattern.size() && pattern[at] == '%') {
      expansion.text += '%';
      i = at;
      continue;
    }
    // A width of one or two digits, with or without the zero that printf wants before it.
    int width = 0;
    for (; at < pattern.size() && at < i + 4 && pattern[at] >= '0' && pattern[at] <= '9'; ++at) {
      width = 10 * width + (pattern[at] - '0');
    }
    if (at == pattern.size() || pattern[at] != 'd') {
      return std::nullopt;
    }
    expansion.text += fmt::format("{:0{}}", frame, width);
    ++expansion.numbers;
    i = at;
  }
  return expansion;
}

}  // namespace

absl::Status CheckPattern(const std::string& pattern) {
  const auto expansion = Expand(pattern, 0);
  if (expansion && expansion->numbers == 1) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      fmt::format("is '{}'; allowed with --frames: a name with one frame number in it, such as "
                  "'name.%04d.ext'",
                  pattern));
}

std::string ExpandPattern(const std::string& pattern, int64_t frame) {
  const auto expansion = Expand(pattern, frame);
  return expansion ? expansion->text : pattern;
}

}  // namespace halflight::client
