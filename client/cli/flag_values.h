// Reads the values of flags: vectors, colours, sizes, lists of frames, outputs, lights.
// Errors are InvalidArgument: the value received and the values allowed; the caller adds the flag.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/options.h"

namespace halflight::client {

// What colours and other 32-bit floats of a request may be: in decimal, below the largest float.
inline constexpr double kLargestFloat = 3e38;

// How far from 0 eyes, targets and lights may be along an axis, as the service has it.
inline constexpr double kFarthestPlace = 1e18;

// "1,-2.5,3": finite numbers.
absl::StatusOr<Vec3> ParseVector(std::string_view text);
// The same, of a place.
absl::StatusOr<Vec3> ParsePlace(std::string_view text);
// "0.5" or "0.5,0.6,0.7": finite and >= 0.
absl::StatusOr<Vec3> ParseColor(std::string_view text);
// "640x480".
absl::StatusOr<Size> ParseSize(std::string_view text);
// "x,y,width,height".
absl::StatusOr<std::vector<uint32_t>> ParseCrop(std::string_view text);
// "24-40", "24-40x2" (every second), "1,5,24-40": each frame once, at most 1,000,000.
absl::StatusOr<std::vector<int64_t>> ParseFrames(std::string_view text);
// "frame.png" (the beauty) or "light=light.exr".
absl::StatusOr<OutputFlag> ParseOutput(std::string_view text);
// "x,y,z" (direction of travel), "point:x,y,z", "camera".
absl::StatusOr<LightFlag> ParseLight(std::string_view text);

// Of --measure-error=SAMPLES; "true" where no number is given: 0, the server's default.
absl::StatusOr<uint32_t> ParseErrorSamples(std::string_view text);
// A whole number from 0 to 2^64 - 1.
absl::StatusOr<uint64_t> ParseSeed(std::string_view text);

// What an output is called in flags and reports, such as "light"; and all of them, for messages.
std::string OutputName(v1::OutputKind kind);
std::string OutputNames();

}  // namespace halflight::client
