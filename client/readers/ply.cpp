#include "client/readers/ply.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/readers/ply_header.h"
#include "client/readers/scalar.h"
#include "client/readers/text.h"

namespace halflight::client {

namespace {

// The value of an integer type that means 1; none for floating-point types.
std::optional<double> FullScale(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
      return 127;
    case ScalarType::kInt16:
      return 32767;
    case ScalarType::kUint16:
      return 65535;
    case ScalarType::kUint8:
    case ScalarType::kInt32:
    case ScalarType::kUint32:
      return 255;
    default:
      return std::nullopt;
  }
}

double LinearFromSrgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

// Where one property of the vertices goes, and what is done to it on the way.
struct VertexColumn {
  Column column;
  std::optional<double> full_scale;
  bool is_srgb = false;

  [[nodiscard]] double Convert(double value) const {
    if (full_scale) {
      value /= *full_scale;
    }
    return is_srgb ? LinearFromSrgb(value) : value;
  }
};

using VertexColumns = std::vector<std::optional<VertexColumn>>;

// The least that one instance can take in the file, bytes.
uint64_t LeastBytes(const PlyElement& element, PlyEncoding encoding) {
  uint64_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    // A digit and what separates it from the next.
    const uint64_t binary = SizeOf(property.is_list ? property.count_type : property.type);
    bytes += encoding == PlyEncoding::kAscii ? 2 : binary;
  }
  return bytes;
}

// Compares what an element promises with what is left of the file, so that a count is believed
// only where there are bytes for it. (The last separator of an ascii file may be missing.)
absl::Status CheckCount(const PlyElement& element, PlyEncoding encoding, size_t offset,
                        size_t bytes_left) {
  const uint64_t least = LeastBytes(element, encoding);
  if (least == 0 || element.count <= (bytes_left + 1) / least) {
    return absl::OkStatus();
  }
  return absl::DataLossError(fmt::format(
      "byte {}: expected {} x '{}' of at least {} bytes, found {} bytes to the end of the file",
      offset, element.count, element.name, least, bytes_left));
}

// Reads one instance after the other from a binary body.
class BinaryBody {
 public:
  BinaryBody(std::string_view bytes, size_t offset, std::endian order)
      : bytes_(bytes), offset_(offset), order_(order) {}

  absl::Status CheckElement(const PlyElement& element) const {
    return CheckCount(element, PlyEncoding::kBinaryLittleEndian, offset_, bytes_.size() - offset_);
  }

  template <typename Sink>
  absl::Status ReadInstance(const PlyElement& element, uint64_t index, Sink sink) {
    for (size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      const ScalarType type = property.is_list ? property.count_type : property.type;
      if (!Has(SizeOf(type))) {
        return Truncated(element, index, property, static_cast<double>(SizeOf(type)));
      }
      const double value = LoadScalar(bytes_.data() + offset_, type, order_);
      offset_ += SizeOf(type);
      if (!property.is_list) {
        sink(i, value);
        continue;
      }
      if (!(value >= 0)) {
        return absl::InvalidArgumentError(
            fmt::format("byte {}: {} {}, list '{}': length is {}; allowed: >= 0",
                        offset_ - SizeOf(type), element.name, index, property.name, value));
      }
      const double list_bytes = value * static_cast<double>(SizeOf(property.type));
      if (list_bytes > static_cast<double>(bytes_.size() - offset_)) {
        return Truncated(element, index, property, list_bytes);
      }
      offset_ += static_cast<size_t>(value) * SizeOf(property.type);
    }
    return absl::OkStatus();
  }

 private:
  [[nodiscard]] bool Has(size_t bytes) const { return bytes_.size() - offset_ >= bytes; }
  [[nodiscard]] absl::Status Truncated(const PlyElement& element, uint64_t index,
                                       const PlyProperty& property, double needed) const {
    return absl::DataLossError(
        fmt::format("byte {}: {} {} of {}, property '{}': expected {} bytes, found {} to the end "
                    "of the file",
                    offset_, element.name, index, element.count, property.name, needed,
                    bytes_.size() - offset_));
  }

  std::string_view bytes_;
  size_t offset_;
  std::endian order_;
};

// Reads one instance a line from an ascii body.
class AsciiBody {
 public:
  AsciiBody(std::string_view bytes, const PlyHeader& header)
      : bytes_(bytes),
        header_size_(header.size),
        lines_(bytes.substr(header.size), header.lines + 1) {}

  absl::Status CheckElement(const PlyElement& element) const {
    const size_t offset = header_size_ + lines_.offset();
    return CheckCount(element, PlyEncoding::kAscii, offset, bytes_.size() - offset);
  }

  template <typename Sink>
  absl::Status ReadInstance(const PlyElement& element, uint64_t index, Sink sink) {
    if (element.properties.empty()) {
      return absl::OkStatus();
    }
    std::optional<std::string_view> line;
    do {
      line = lines_.Next();
    } while (line && Trimmed(*line).empty());
    if (!line) {
      return absl::DataLossError(
          fmt::format("line {}: expected {} {} of {}, found the end of the "
                      "file",
                      lines_.line_number() + 1, element.name, index, element.count));
    }
    WordReader words(*line);
    for (size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      const std::string_view word = words.Next();
      if (property.is_list) {
        const auto length = ParseCount(word);
        if (!length || *length > line->size()) {
          return BadWord(element, index, property, "a list's length", word);
        }
        for (uint64_t k = 0; k < *length; ++k) {
          const std::string_view item = words.Next();
          if (!ParseNumber(item)) {
            return BadWord(element, index, property, "a number", item);
          }
        }
      } else if (const auto value = ParseNumber(word)) {
        sink(i, *value);
      } else {
        return BadWord(element, index, property, "a number", word);
      }
    }
    if (const std::string_view rest = words.Next(); !rest.empty()) {
      return absl::InvalidArgumentError(fmt::format(
          "line {}: {} {}: expected {} values, found one more: '{}'", lines_.line_number(),
          element.name, index, element.properties.size(), Excerpt(rest)));
    }
    return absl::OkStatus();
  }

 private:
  [[nodiscard]] absl::Status BadWord(const PlyElement& element, uint64_t index,
                                     const PlyProperty& property, const char* expected,
                                     std::string_view found) const {
    const std::string what =
        found.empty() ? "the end of the line" : fmt::format("'{}'", Excerpt(found));
    return absl::InvalidArgumentError(
        fmt::format("line {}: {} {}, property '{}': expected {}, "
                    "found {}",
                    lines_.line_number(), element.name, index, property.name, expected, what));
  }

  std::string_view bytes_;
  size_t header_size_;
  LineReader lines_;
};

absl::StatusOr<VertexColumns> MatchVertex(const PlyElement& vertex) {
  std::vector<std::string> names;
  for (const PlyProperty& property : vertex.properties) {
    names.push_back(property.is_list ? "" : property.name);  // a list is no column
  }
  const auto matched = MatchColumns(names);
  if (!matched.ok()) {
    return matched.status();
  }
  VertexColumns columns(names.size());
  for (size_t i = 0; i < names.size(); ++i) {
    const std::optional<Column>& column = (*matched)[i];
    if (!column) {
      continue;
    }
    columns[i] = VertexColumn{*column, std::nullopt, false};
    const bool is_color =
        column->attribute == Attribute::kColor || column->attribute == Attribute::kEmission;
    if (is_color || column->attribute == Attribute::kOpacity) {
      columns[i]->full_scale = FullScale(vertex.properties[i].type);
      columns[i]->is_srgb = is_color && columns[i]->full_scale;
    }
  }
  return columns;
}

template <typename Body>
absl::StatusOr<Columns> ReadBody(const PlyHeader& header, Body body) {
  for (const PlyElement& element : header.elements) {
    if (absl::Status status = body.CheckElement(element); !status.ok()) {
      return status;
    }
    if (element.name != "vertex") {
      for (uint64_t i = 0; i < element.count && !element.properties.empty(); ++i) {
        if (absl::Status status = body.ReadInstance(element, i, [](size_t, double) {});
            !status.ok()) {
          return status;
        }
      }
      continue;
    }
    const auto columns = MatchVertex(element);
    if (!columns.ok()) {
      return columns.status();
    }
    std::vector<std::optional<Column>> plain;
    for (const auto& column : *columns) {
      plain.push_back(column ? std::optional(column->column) : std::nullopt);
    }
    Columns values;
    values.Resize(element.count, plain);
    for (uint64_t i = 0; i < element.count; ++i) {
      absl::Status status = body.ReadInstance(element, i, [&](size_t property, double value) {
        if (const auto& column = (*columns)[property]) {
          values.Set(i, column->column, column->Convert(value));
        }
      });
      if (!status.ok()) {
        return status;
      }
    }
    return values;
  }
  return absl::InvalidArgumentError("expected an element named 'vertex', found none");
}

}  // namespace

absl::StatusOr<Columns> ReadPly(std::string_view bytes) {
  const auto header = ParsePlyHeader(bytes);
  if (!header.ok()) {
    return header.status();
  }
  if (header->encoding == PlyEncoding::kAscii) {
    return ReadBody(*header, AsciiBody(bytes, *header));
  }
  const auto order =
      header->encoding == PlyEncoding::kBinaryLittleEndian ? std::endian::little : std::endian::big;
  return ReadBody(*header, BinaryBody(bytes, header->size, order));
}

}  // namespace halflight::client
