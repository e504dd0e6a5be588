// Reads encoded bytes back through the image library's readers, for the tests of the encoders.
// Converts nothing but the number type; attributes come under the library's names.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace halflight {

struct DecodedPart {
  int width = 0;
  int height = 0;
  std::array<int, 2> offset{};        // data window in the whole image
  std::array<int, 4> whole_window{};  // x, y, width, height of the whole image
  std::vector<std::string> channels;
  std::string sample_type;      // "uint8", "half" and so on
  std::vector<float> values;    // integers come as fractions of the largest
  std::vector<uint16_t> codes;  // of 16 bit; those of 8 bit are times 257
  std::map<std::string, std::string> texts;
  std::map<std::string, std::array<float, 16>> matrices;  // row by row, as the file has them
};

// All parts of the file; none where it cannot be read. `format` is "png" or "exr".
std::vector<DecodedPart> Decode(const std::string& bytes, const std::string& format);

}  // namespace halflight
