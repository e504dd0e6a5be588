#include "client/readers/ply_header.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <utility>

#include "client/readers/text.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

struct NamedType {
  const char* name;
  const char* sized_name;
  ScalarType type;
};
constexpr std::array<NamedType, 8> kTypes = {{
    {"char", "int8", ScalarType::kInt8},
    {"uchar", "uint8", ScalarType::kUint8},
    {"short", "int16", ScalarType::kInt16},
    {"ushort", "uint16", ScalarType::kUint16},
    {"int", "int32", ScalarType::kInt32},
    {"uint", "uint32", ScalarType::kUint32},
    {"float", "float32", ScalarType::kFloat32},
    {"double", "float64", ScalarType::kFloat64},
}};

absl::StatusOr<ScalarType> ParseType(std::string_view word) {
  for (const NamedType& type : kTypes) {
    if (word == type.name || word == type.sized_name) {
      return type.type;
    }
  }
  return absl::InvalidArgumentError(
      fmt::format("property type is '{}'; allowed: char, uchar, short, ushort, int, uint, float, "
                  "double, or int8 to float64",
                  Excerpt(word)));
}

absl::Status ParseFormat(WordReader& words, PlyHeader& header) {
  const std::string_view name = words.Next();
  if (name == "ascii") {
    header.encoding = PlyEncoding::kAscii;
  } else if (name == "binary_little_endian") {
    header.encoding = PlyEncoding::kBinaryLittleEndian;
  } else if (name == "binary_big_endian") {
    header.encoding = PlyEncoding::kBinaryBigEndian;
  } else {
    return absl::InvalidArgumentError(fmt::format(
        "format is '{}'; allowed: ascii, binary_little_endian, binary_big_endian", Excerpt(name)));
  }
  const std::string_view version = words.Next();
  return version == "1.0" ? absl::OkStatus()
                          : absl::InvalidArgumentError(fmt::format(
                                "format version is '{}'; allowed: 1.0", Excerpt(version)));
}

absl::Status ParseElement(WordReader& words, PlyHeader& header) {
  PlyElement element;
  element.name = std::string(words.Next());
  const std::string_view count = words.Next();
  const std::optional<uint64_t> parsed = ParseCount(count);
  if (element.name.empty() || !parsed) {
    return absl::InvalidArgumentError(
        fmt::format("expected 'element <name> <count>', found count '{}' of element '{}'",
                    Excerpt(count), Excerpt(element.name)));
  }
  element.count = *parsed;
  header.elements.push_back(std::move(element));
  return absl::OkStatus();
}

absl::Status ParseProperty(WordReader& words, PlyHeader& header) {
  if (header.elements.empty()) {
    return absl::InvalidArgumentError("a property stands before the first element");
  }
  PlyProperty property;
  std::string_view word = words.Next();
  if (word == "list") {
    property.is_list = true;
    const auto count_type = ParseType(words.Next());
    if (!count_type.ok()) {
      return count_type.status();
    }
    property.count_type = *count_type;
    word = words.Next();
  }
  const auto type = ParseType(word);
  if (!type.ok()) {
    return type.status();
  }
  property.type = *type;
  property.name = std::string(words.Next());
  if (property.name.empty()) {
    return absl::InvalidArgumentError("expected a property's name, found the end of the line");
  }
  PlyElement& element = header.elements.back();
  for (const PlyProperty& other : element.properties) {
    if (other.name == property.name) {
      return absl::InvalidArgumentError(fmt::format("element '{}' has property '{}' twice",
                                                    element.name, Excerpt(property.name)));
    }
  }
  element.properties.push_back(std::move(property));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PlyHeader> ParsePlyHeader(std::string_view bytes) {
  PlyHeader header;
  LineReader lines(bytes);
  const auto magic = lines.Next();
  if (!magic || *magic != "ply") {
    return absl::InvalidArgumentError(
        fmt::format("line 1: expected 'ply', found '{}'", Excerpt(magic.value_or(""))));
  }
  bool have_format = false;
  while (const auto line = lines.Next()) {
    WordReader words(*line);
    const std::string_view keyword = words.Next();
    absl::Status status;
    if (keyword == "format") {
      status = ParseFormat(words, header);
      have_format = true;
    } else if (keyword == "element") {
      status = ParseElement(words, header);
    } else if (keyword == "property") {
      status = ParseProperty(words, header);
    } else if (keyword == "end_header") {
      if (!have_format) {
        status = absl::InvalidArgumentError("the header ends without a 'format' line");
      }
      header.size = lines.offset();
      header.lines = lines.line_number();
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      status = absl::InvalidArgumentError(
          fmt::format("expected format, comment, obj_info, element, property or end_header, found "
                      "'{}'",
                      Excerpt(keyword)));
    }
    if (!status.ok()) {
      return absl::Status(status.code(),
                          fmt::format("line {}: {}", lines.line_number(), MessageOf(status)));
    }
    if (keyword == "end_header") {
      return header;
    }
  }
  return absl::DataLossError(fmt::format(
      "line {}: the file ends within its header: expected 'end_header'", lines.line_number()));
}

}  // namespace halflight::client
