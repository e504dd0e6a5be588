// An image file in the terms of the image library, written into memory.
// Knows nothing of ours: what a file should say is the encoders' business. The library's own types
// stay out of this header, since its headers cost seconds in every source that includes them.
#pragma once

#include <array>
#include <cstdint>
#include <stop_token>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <glm/vec2.hpp>

#include "absl/status/status.h"

namespace halflight {

enum class SampleType : uint8_t { kUint8, kUint16, kHalf, kFloat };

using Chromaticities = std::array<float, 8>;  // x and y of red, green, blue and white
using MatrixRows = std::array<float, 16>;     // row by row
// What a file says to its readers. Of such texts nothing is kept once the file is written.
struct Remark {
  std::string text;
};
// A string is a word that the library knows, or one of few: it keeps them for ever.
using AttributeValue = std::variant<int, std::string, Remark, Chromaticities, MatrixRows>;

struct ImageFile {
  const char* format = "";  // the library's name, which is also the ending of such files' names
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;
  SampleType given = SampleType::kFloat;   // as the pixels are handed over
  SampleType stored = SampleType::kFloat;  // as they stand in the file
  bool associated_alpha = false;           // of the channel named A, if there is one among several
  // Where the pixels lie in the whole image, for formats that can say it.
  glm::ivec2 offset{0};
  glm::ivec2 display_size{0};
  // Under the library's names. Later ones replace earlier ones of the same name.
  std::vector<std::pair<std::string, AttributeValue>> attributes;
  // One image a name, each with all of the above; no names: one nameless image.
  std::vector<std::string> parts;
};

// `pixels` holds the images one after the other, each width * height * channels values of `given`.
// Replaces `bytes`. Internal with the library's message on failure, the system's error where memory
// for the file cannot be had, Cancelled soon after `stop` was requested. Any thread.
absl::Status WriteToMemory(const ImageFile& file, const void* pixels, const std::stop_token& stop,
                           std::string& bytes);

}  // namespace halflight
