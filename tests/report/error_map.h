// Colours for errors: blue too dark, white right, red too light; told apart by the colour-blind.
#pragma once

#include <array>
#include <cstdint>

namespace halflight::report {

// Errors at which the colours end, in parts of the reference's mean.
inline constexpr double kErrorMapEnd = 0.5;

// sRGB codes of an error in parts of the reference's mean; what is beyond the ends is as at them.
std::array<uint8_t, 3> ErrorColor(double error);

}  // namespace halflight::report
