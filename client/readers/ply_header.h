// The header of a PLY file: which elements and properties it declares.
// Leaves out the values that follow it (ply.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/readers/scalar.h"

namespace halflight::client {

enum class PlyEncoding : unsigned char { kAscii, kBinaryLittleEndian, kBinaryBigEndian };

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::kFloat32;
  bool is_list = false;
  ScalarType count_type = ScalarType::kUint8;  // of a list's length
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  size_t size = 0;   // bytes, up to the first value
  size_t lines = 0;  // as many as the header has
};

// InvalidArgument names the line.
absl::StatusOr<PlyHeader> ParsePlyHeader(std::string_view bytes);

}  // namespace halflight::client
