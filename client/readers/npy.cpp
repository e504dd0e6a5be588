#include "client/readers/npy.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/readers/scalar.h"
#include "client/readers/text.h"

namespace halflight::client {

namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);
constexpr std::string_view kShapes = "(N, 3) for x y z, or (N, 4) for x y z radius";

struct NpyHeader {
  ScalarType type = ScalarType::kFloat32;
  std::endian order = std::endian::little;
  bool fortran_order = false;
  uint64_t rows = 0;
  uint64_t columns = 0;
};

// What stands after 'key': in the dictionary, which is Python source such as
// {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }; empty where the key is missing.
std::string_view ValueOf(std::string_view dictionary, const std::string& key) {
  size_t at = dictionary.find("'" + key + "'");
  if (at == std::string_view::npos) {
    return {};
  }
  at = dictionary.find(':', at + key.size() + 2);
  return at == std::string_view::npos ? std::string_view() : Trimmed(dictionary.substr(at + 1));
}

absl::Status ParseType(std::string_view value, NpyHeader& header) {
  const std::string_view name = value.substr(0, 5);
  if (name == "'<f4'" || name == "'=f4'" || name == "'>f4'") {
    header.type = ScalarType::kFloat32;
  } else if (name == "'<f8'" || name == "'=f8'" || name == "'>f8'") {
    header.type = ScalarType::kFloat64;
  } else {
    return absl::InvalidArgumentError(
        fmt::format("header: descr is {}; allowed: '<f4', '>f4', '<f8', '>f8'",
                    Excerpt(value.substr(0, value.find(',')))));
  }
  header.order = name[1] == '>' ? std::endian::big : std::endian::little;
  return absl::OkStatus();
}

absl::Status ParseShape(std::string_view value, NpyHeader& header) {
  const size_t close = value.find(')');
  if (value.empty() || value.front() != '(' || close == std::string_view::npos) {
    return absl::InvalidArgumentError(
        fmt::format("header: shape is '{}'; allowed: {}", Excerpt(value), kShapes));
  }
  const std::string_view shape = value.substr(1, close - 1);
  const size_t comma = shape.find(',');
  const auto rows = ParseCount(Trimmed(shape.substr(0, comma)));
  const auto columns =
      comma == std::string_view::npos ? std::nullopt : ParseCount(Trimmed(shape.substr(comma + 1)));
  if (!rows || !columns || *columns < 3 || *columns > 4) {
    return absl::InvalidArgumentError(
        fmt::format("header: shape is ({}); allowed: {}", Excerpt(shape), kShapes));
  }
  header.rows = *rows;
  header.columns = *columns;
  return absl::OkStatus();
}

absl::StatusOr<NpyHeader> ParseDictionary(std::string_view dictionary) {
  NpyHeader header;
  if (absl::Status status = ParseType(ValueOf(dictionary, "descr"), header); !status.ok()) {
    return status;
  }
  if (absl::Status status = ParseShape(ValueOf(dictionary, "shape"), header); !status.ok()) {
    return status;
  }
  const std::string_view fortran_order = ValueOf(dictionary, "fortran_order");
  header.fortran_order = fortran_order.substr(0, 4) == "True";
  if (!header.fortran_order && fortran_order.substr(0, 5) != "False") {
    return absl::InvalidArgumentError(
        fmt::format("header: fortran_order is '{}'; allowed: True, False", Excerpt(fortran_order)));
  }
  return header;
}

// The offset of the first value, from the header's length, whose width follows the version.
absl::StatusOr<size_t> DictionaryBounds(std::string_view bytes, size_t& start) {
  if (bytes.substr(0, kMagic.size()) != kMagic) {
    return absl::InvalidArgumentError(fmt::format("byte 0: expected '\\x93NUMPY', found '{}'",
                                                  Excerpt(bytes.substr(0, kMagic.size()))));
  }
  const int version = bytes.size() > 6 ? static_cast<unsigned char>(bytes[6]) : 0;
  if (version < 1 || version > 3) {
    return absl::InvalidArgumentError(
        fmt::format("byte 6: format version is {}; allowed: 1, 2, 3", version));
  }
  start = version == 1 ? 10 : 12;
  if (bytes.size() < start) {
    return absl::DataLossError(
        fmt::format("byte 8: expected the header's length, found the end of the file at byte {}",
                    bytes.size()));
  }
  const size_t length = version == 1 ? LoadAs<uint16_t>(&bytes[8], std::endian::little)
                                     : LoadAs<uint32_t>(&bytes[8], std::endian::little);
  if (length > bytes.size() - start) {
    return absl::DataLossError(
        fmt::format("byte {}: expected a header of {} bytes, found {} to the end of the file",
                    start, length, bytes.size() - start));
  }
  return start + length;
}

}  // namespace

absl::StatusOr<Columns> ReadNpy(std::string_view bytes) {
  size_t start = 0;
  const auto body = DictionaryBounds(bytes, start);
  if (!body.ok()) {
    return body.status();
  }
  const auto header = ParseDictionary(bytes.substr(start, *body - start));
  if (!header.ok()) {
    return header.status();
  }

  // Believe the shape only where the file has as many bytes as it asks for.
  const size_t scalar = SizeOf(header->type);
  const size_t found = bytes.size() - *body;
  const uint64_t row_bytes = (header->columns == 4 ? 4 : 3) * scalar;
  if (found / row_bytes < header->rows) {
    return absl::DataLossError(
        fmt::format("byte {}: expected {} rows of {} bytes, found {} bytes to the end of the file",
                    *body, header->rows, row_bytes, found));
  }
  if (found != header->rows * row_bytes) {
    return absl::InvalidArgumentError(fmt::format(
        "byte {}: expected the end of the file after {} rows, found {} bytes more",
        *body + header->rows * row_bytes, header->rows, found - header->rows * row_bytes));
  }

  std::vector<std::optional<Column>> columns;
  for (size_t i = 0; i < header->columns; ++i) {
    columns.emplace_back(i < 3 ? Column{Attribute::kPosition, i} : Column{Attribute::kRadius, 0});
  }
  Columns values;
  values.Resize(header->rows, columns);
  for (size_t row = 0; row < header->rows; ++row) {
    for (size_t i = 0; i < columns.size(); ++i) {
      const size_t at = header->fortran_order ? i * header->rows + row : row * columns.size() + i;
      values.Set(row, *columns[i],
                 LoadScalar(&bytes[*body + at * scalar], header->type, header->order));
    }
  }
  return values;
}

}  // namespace halflight::client
