// Scalars of binary files: their types, sizes and bytes, in either byte order.
// Knows nothing of any format.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace halflight::client {

enum class ScalarType : unsigned char {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kFloat32,
  kFloat64,
};

constexpr size_t SizeOf(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
    case ScalarType::kUint8:
      return 1;
    case ScalarType::kInt16:
    case ScalarType::kUint16:
      return 2;
    case ScalarType::kInt32:
    case ScalarType::kUint32:
    case ScalarType::kFloat32:
      return 4;
    case ScalarType::kFloat64:
      break;
  }
  return 8;
}

template <typename T>
T LoadAs(const char* bytes, std::endian order) {
  char swapped[sizeof(T)];
  for (size_t i = 0; i < sizeof(T); ++i) {
    swapped[i] = bytes[order == std::endian::native ? i : sizeof(T) - 1 - i];
  }
  T value;
  std::memcpy(&value, swapped, sizeof(T));
  return value;
}

// The scalar that starts at `bytes`; SizeOf(type) bytes must be there.
inline double LoadScalar(const char* bytes, ScalarType type, std::endian order) {
  switch (type) {
    case ScalarType::kInt8:
      return LoadAs<int8_t>(bytes, order);
    case ScalarType::kUint8:
      return LoadAs<uint8_t>(bytes, order);
    case ScalarType::kInt16:
      return LoadAs<int16_t>(bytes, order);
    case ScalarType::kUint16:
      return LoadAs<uint16_t>(bytes, order);
    case ScalarType::kInt32:
      return LoadAs<int32_t>(bytes, order);
    case ScalarType::kUint32:
      return LoadAs<uint32_t>(bytes, order);
    case ScalarType::kFloat32:
      return LoadAs<float>(bytes, order);
    case ScalarType::kFloat64:
      return LoadAs<double>(bytes, order);
  }
  return 0;
}

}  // namespace halflight::client
