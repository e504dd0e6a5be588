#include "server/log/log_event.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <type_traits>

#include <fmt/format.h>

namespace halflight {
namespace {

constexpr char32_t kReplacement = 0xfffd;

// Takes one character off the front: its code point, and U+FFFD for a byte that begins none.
// Table 3-7 of the Unicode standard: no overlong forms, no surrogates, none above U+10FFFF.
char32_t TakeCharacter(std::string_view& text) {
  const auto byte = [&text](size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
  };
  const unsigned lead = byte(0);
  size_t length = 1;
  char32_t point = lead;
  unsigned low = 0x80;  // what the second byte may be
  unsigned high = 0xbf;
  if (lead >= 0xc2 && lead <= 0xdf) {
    length = 2;
    point = lead & 0x1fU;
  } else if (lead >= 0xe0 && lead <= 0xef) {
    length = 3;
    point = lead & 0x0fU;
    low = lead == 0xe0 ? 0xa0 : low;
    high = lead == 0xed ? 0x9f : high;
  } else if (lead >= 0xf0 && lead <= 0xf4) {
    length = 4;
    point = lead & 0x07U;
    low = lead == 0xf0 ? 0x90 : low;
    high = lead == 0xf4 ? 0x8f : high;
  } else if (lead >= 0x80) {
    point = kReplacement;
  }
  for (size_t i = 1; i < length; ++i) {
    const unsigned next = byte(i);
    if (next < low || next > high) {
      text.remove_prefix(1);
      return kReplacement;
    }
    point = (point << 6U) | (next & 0x3fU);
    low = 0x80;
    high = 0xbf;
  }
  text.remove_prefix(length);
  return point;
}

// C0, C1 with the terminal's escapes, and the two that some readers take for ends of lines.
bool IsControl(char32_t point) {
  return point < 0x20 || (point >= 0x7f && point < 0xa0) || point == 0x2028 || point == 0x2029;
}

void AppendQuoted(std::string& line, std::string_view text) {
  const bool cut = text.size() > kMaxLoggedBytes;
  std::string_view left = text.substr(0, kMaxLoggedBytes);
  line += '"';
  while (!left.empty()) {
    const std::string_view before = left;
    const char32_t point = TakeCharacter(left);
    if (point == '\n') {
      line += "\\n";
    } else if (point == '"' || point == '\\') {
      line += '\\';
      line += static_cast<char>(point);
    } else if (IsControl(point)) {
      fmt::format_to(std::back_inserter(line), "\\u{:04x}", static_cast<unsigned>(point));
    } else if (point == kReplacement) {
      line += "\xef\xbf\xbd";
    } else {
      line += before.substr(0, before.size() - left.size());
    }
  }
  line += cut ? "...\"" : "\"";
}

bool NeedsNoQuotes(std::string_view text) {
  return !text.empty() && text.size() <= kMaxLoggedBytes &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return c > ' ' && c < 0x7f && c != '"' && c != '\\' && c != '=';
         });
}

template <typename Number>
void AppendNumber(std::string& line, Number number) {
  if constexpr (std::is_floating_point_v<Number>) {
    fmt::format_to(std::back_inserter(line), "{:.6g}", number);
  } else {
    fmt::format_to(std::back_inserter(line), "{}", number);
  }
}

void AppendText(std::string& line, const LogField::Value& value) {
  std::visit(
      [&line](const auto& held) {
        if constexpr (std::is_same_v<std::decay_t<decltype(held)>, std::string>) {
          NeedsNoQuotes(held) ? line.append(held) : (AppendQuoted(line, held), line);
        } else {
          AppendNumber(line, held);
        }
      },
      value);
}

void AppendJson(std::string& line, const LogField::Value& value) {
  std::visit(
      [&line](const auto& held) {
        using Held = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, std::string>) {
          AppendQuoted(line, held);
        } else if constexpr (std::is_same_v<Held, double>) {
          std::isfinite(held) ? AppendNumber(line, held) : void(line += "null");
        } else {
          AppendNumber(line, held);
        }
      },
      value);
}

}  // namespace

std::string LogText(std::string_view event, const LogFields& fields) {
  std::string line(event);
  for (const LogField& field : fields) {
    line += ' ';
    line += field.key();
    line += '=';
    AppendText(line, field.value());
  }
  return line;
}

std::string LogJson(std::string_view event, const LogFields& fields) {
  std::string line = "\"event\":";
  AppendQuoted(line, event);
  for (const LogField& field : fields) {
    line += ',';
    AppendQuoted(line, field.key());
    line += ':';
    AppendJson(line, field.value());
  }
  return line;
}

}  // namespace halflight
