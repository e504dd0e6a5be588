#include "client/readers/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "client/readers/text.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

absl::Status LineError(const LineReader& lines, const std::string& what) {
  return absl::InvalidArgumentError(fmt::format("line {}: {}", lines.line_number(), what));
}

// Splits a line at its commas into `fields`, quotes removed. False where a quote is never closed,
// or something follows it.
bool SplitFields(std::string_view line, std::vector<std::string>& fields) {
  fields.clear();
  while (true) {
    std::string_view rest = Trimmed(line);
    if (rest.empty() || rest.front() != '"') {
      const size_t comma = line.find(',');
      fields.emplace_back(Trimmed(line.substr(0, comma)));
      if (comma == std::string_view::npos) {
        return true;
      }
      line.remove_prefix(comma + 1);
      continue;
    }
    std::string field;
    size_t at = 1;
    for (; at < rest.size(); ++at) {
      if (rest[at] != '"') {
        field += rest[at];
      } else if (at + 1 < rest.size() && rest[at + 1] == '"') {
        field += rest[at++];  // a doubled quote stands for one
      } else {
        break;
      }
    }
    if (at >= rest.size()) {
      return false;
    }
    fields.emplace_back(Trimmed(field));
    rest = Trimmed(rest.substr(at + 1));
    if (rest.empty()) {
      return true;
    }
    if (rest.front() != ',') {
      return false;
    }
    line = rest.substr(1);
  }
}

// The next line with anything in it.
std::optional<std::string_view> NextFilled(LineReader& lines) {
  while (const auto line = lines.Next()) {
    if (!Trimmed(*line).empty()) {
      return line;
    }
  }
  return std::nullopt;
}

}  // namespace

absl::StatusOr<Columns> ReadCsv(std::string_view bytes) {
  if (bytes.substr(0, 3) == "\xEF\xBB\xBF") {
    bytes.remove_prefix(3);  // the byte order mark that spreadsheets write
  }
  LineReader lines(bytes);
  const auto header = NextFilled(lines);
  if (!header) {
    return absl::InvalidArgumentError(
        "line 1: expected a line with the columns' names, found the end of the file");
  }
  std::vector<std::string> names;
  if (!SplitFields(*header, names)) {
    return LineError(lines, "a quoted name does not end as a field has to");
  }
  const auto columns = MatchColumns(names);
  if (!columns.ok()) {
    return LineError(lines, MessageOf(columns.status()));
  }

  Columns values;
  std::vector<std::string> fields;
  size_t particle = 0;
  size_t capacity = 0;
  for (; const auto line = NextFilled(lines); ++particle) {
    if (!SplitFields(*line, fields)) {
      return LineError(lines, "a quoted field does not end as a field has to");
    }
    if (fields.size() != names.size()) {
      return LineError(lines, fmt::format("expected {} fields, as the first line has, found {}",
                                          names.size(), fields.size()));
    }
    if (particle == capacity) {
      capacity = std::max<size_t>(64, 2 * capacity);
      values.Resize(capacity, *columns);
    }
    for (size_t i = 0; i < fields.size(); ++i) {
      if (!(*columns)[i]) {
        continue;
      }
      const auto value = ParseNumber(fields[i]);
      if (!value) {
        return LineError(lines, fmt::format("column '{}': expected a number, found '{}'", names[i],
                                            Excerpt(fields[i])));
      }
      values.Set(particle, *(*columns)[i], *value);
    }
  }
  values.Resize(particle, *columns);
  return values;
}

}  // namespace halflight::client
