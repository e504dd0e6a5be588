#include "client/cli/flag_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "client/readers/text.h"

namespace halflight::client {

namespace {

struct NamedOutput {
  const char* name;
  v1::OutputKind kind;
};
constexpr std::array<NamedOutput, 7> kOutputs = {{
    {"beauty", v1::OUTPUT_KIND_BEAUTY},
    {"coverage", v1::OUTPUT_KIND_COVERAGE},
    {"depth", v1::OUTPUT_KIND_DEPTH},
    {"transmittance", v1::OUTPUT_KIND_LIGHT_TRANSMITTANCE},
    {"light", v1::OUTPUT_KIND_LIGHT_BUFFER},
    {"layers", v1::OUTPUT_KIND_LIGHT_LAYERS},
    {"error", v1::OUTPUT_KIND_ERROR},
}};

absl::Status Unexpected(std::string_view received, std::string_view allowed) {
  return absl::InvalidArgumentError(fmt::format("is '{}'; allowed: {}", received, allowed));
}

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const size_t at = text.find(separator);
    parts.push_back(Trimmed(text.substr(0, at)));
    if (at == std::string_view::npos) {
      return parts;
    }
    text.remove_prefix(at + 1);
  }
}

// Finite numbers between commas; empty where one is not.
std::vector<double> Numbers(std::string_view text) {
  std::vector<double> numbers;
  for (const std::string_view part : Split(text, ',')) {
    const auto number = ParseNumber(part);
    if (!number || !std::isfinite(*number)) {
      return {};
    }
    numbers.push_back(*number);
  }
  return numbers;
}

// Counts between separators, each below 2^31; empty where one is not.
std::vector<uint32_t> Counts(std::string_view text, char separator) {
  std::vector<uint32_t> counts;
  for (const std::string_view part : Split(text, separator)) {
    const auto count = ParseCount(part);
    if (!count || *count > INT32_MAX) {
      return {};
    }
    counts.push_back(static_cast<uint32_t>(*count));
  }
  return counts;
}

}  // namespace

absl::StatusOr<Vec3> ParseVector(std::string_view text) {
  const std::vector<double> numbers = Numbers(text);
  if (numbers.size() != 3) {
    return Unexpected(text, "three numbers x,y,z");
  }
  return Vec3{numbers[0], numbers[1], numbers[2]};
}

absl::StatusOr<Vec3> ParsePlace(std::string_view text) {
  auto place = ParseVector(text);
  const auto is_near = [](double value) { return std::abs(value) <= kFarthestPlace; };
  if (!place.ok() || !std::all_of(place->begin(), place->end(), is_near)) {
    return Unexpected(text, "three numbers x,y,z, each from -1e18 to 1e18");
  }
  return place;
}

absl::StatusOr<Vec3> ParseColor(std::string_view text) {
  std::vector<double> numbers = Numbers(text);
  if (numbers.size() == 1) {
    numbers.resize(3, numbers[0]);
  }
  const auto fits = [](double number) { return number >= 0 && number <= kLargestFloat; };
  if (numbers.size() != 3 || !std::all_of(numbers.begin(), numbers.end(), fits)) {
    return Unexpected(text, "one number or three r,g,b, each from 0 to 3e38");
  }
  return Vec3{numbers[0], numbers[1], numbers[2]};
}

absl::StatusOr<Size> ParseSize(std::string_view text) {
  const std::vector<uint32_t> counts = Counts(text, 'x');
  if (counts.size() != 2 || counts[0] == 0 || counts[1] == 0) {
    return Unexpected(text, "WIDTHxHEIGHT in pixels, such as 640x480");
  }
  return Size{counts[0], counts[1]};
}

absl::StatusOr<std::vector<uint32_t>> ParseCrop(std::string_view text) {
  std::vector<uint32_t> counts = Counts(text, ',');
  if (counts.size() != 4 || counts[2] == 0 || counts[3] == 0) {
    return Unexpected(text, "x,y,width,height in pixels, with x,y the top left corner");
  }
  return counts;
}

absl::StatusOr<std::vector<int64_t>> ParseFrames(std::string_view text) {
  constexpr std::string_view kAllowed =
      "numbers and ranges such as 24-40, 24-40x2 or 1,5,24-40, each frame once";
  constexpr size_t kMostFrames = 1000000;
  std::vector<int64_t> frames;
  std::set<int64_t> seen;
  for (const std::string_view part : Split(text, ',')) {
    const size_t dash = part.find('-');
    const size_t times = part.find('x');
    const auto first = ParseCount(part.substr(0, std::min(dash, times)));
    const auto last =
        dash == std::string_view::npos
            ? first
            : ParseCount(part.substr(dash + 1,
                                     times == std::string_view::npos ? times : times - dash - 1));
    const auto step = times == std::string_view::npos ? std::optional<uint64_t>(1)
                                                      : ParseCount(part.substr(times + 1));
    const bool step_without_range = times < dash;
    if (!first || !last || !step || *step == 0 || *last < *first || step_without_range ||
        *last > INT32_MAX) {
      return Unexpected(text, kAllowed);
    }
    for (uint64_t frame = *first; frame <= *last; frame += *step) {
      if (!seen.insert(static_cast<int64_t>(frame)).second || frames.size() == kMostFrames) {
        return Unexpected(text, kAllowed);
      }
      frames.push_back(static_cast<int64_t>(frame));
    }
  }
  return frames;
}

absl::StatusOr<OutputFlag> ParseOutput(std::string_view text) {
  OutputFlag output;
  const size_t equals = text.find('=');
  const std::string_view name = text.substr(0, equals);
  // A slash before the sign of equality makes it part of a path.
  if (equals == std::string_view::npos || name.find('/') != std::string_view::npos) {
    output.path = std::string(text);
  } else {
    output.path = std::string(text.substr(equals + 1));
    output.kind = v1::OUTPUT_KIND_UNSPECIFIED;
    for (const NamedOutput& known : kOutputs) {
      if (name == known.name) {
        output.kind = known.kind;
      }
    }
  }
  if (output.kind == v1::OUTPUT_KIND_UNSPECIFIED || output.path.empty()) {
    return Unexpected(text, fmt::format("PATH or NAME=PATH, with NAME one of {}", OutputNames()));
  }
  return output;
}

absl::StatusOr<LightFlag> ParseLight(std::string_view text) {
  constexpr std::string_view kPoint = "point:";
  LightFlag light;
  if (text == "camera") {
    return light;
  }
  const bool is_point = text.substr(0, kPoint.size()) == kPoint;
  const auto value = is_point ? ParsePlace(text.substr(kPoint.size())) : ParseVector(text);
  if (!value.ok() || (!is_point && *value == Vec3{})) {
    return Unexpected(
        text,
        "x,y,z (the direction in which the light travels, not 0,0,0), point:x,y,z "
        "(where it is, each from -1e18 to 1e18), camera (along the view), or none alone");
  }
  light.kind = is_point ? LightFlag::Kind::kPoint : LightFlag::Kind::kDirection;
  light.value = *value;
  return light;
}

absl::StatusOr<uint32_t> ParseErrorSamples(std::string_view text) {
  if (text == "true") {
    return 0;
  }
  const auto samples = ParseCount(text);
  if (!samples || *samples < 32 || *samples > 1048576) {
    return Unexpected(text, "a whole number of pixels from 32 to 1048576, or nothing");
  }
  return static_cast<uint32_t>(*samples);
}

absl::StatusOr<uint64_t> ParseSeed(std::string_view text) {
  const auto seed = ParseCount(text);
  if (!seed) {
    return Unexpected(text, "a whole number from 0 to 18446744073709551615");
  }
  return *seed;
}

std::string OutputName(v1::OutputKind kind) {
  for (const NamedOutput& known : kOutputs) {
    if (kind == known.kind) {
      return known.name;
    }
  }
  return v1::OutputKind_Name(kind);
}

std::string OutputNames() {
  std::string names;
  for (const NamedOutput& known : kOutputs) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", known.name);
  }
  return names;
}

}  // namespace halflight::client
