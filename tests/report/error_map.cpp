#include "tests/report/error_map.h"

#include <algorithm>
#include <cmath>

namespace halflight::report {

std::array<uint8_t, 3> ErrorColor(double error) {
  // Evenly spaced, from the largest negative error; lightness falls alike to both sides.
  constexpr std::array<std::array<double, 3>, 7> kColors = {{{10, 48, 110},
                                                             {44, 123, 182},
                                                             {158, 202, 225},
                                                             {247, 247, 247},
                                                             {250, 180, 140},
                                                             {214, 82, 60},
                                                             {115, 10, 30}}};
  const double along = std::clamp(0.5 + 0.5 * error / kErrorMapEnd, 0.0, 1.0) *
                       static_cast<double>(kColors.size() - 1);
  const auto lower = std::min(static_cast<size_t>(along), kColors.size() - 2);
  const double fraction = along - static_cast<double>(lower);
  std::array<uint8_t, 3> color{};
  for (size_t c = 0; c < 3; ++c) {
    color[c] = static_cast<uint8_t>(
        std::lround((1.0 - fraction) * kColors[lower][c] + fraction * kColors[lower + 1][c]));
  }
  return color;
}

}  // namespace halflight::report
