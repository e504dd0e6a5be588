// Fills the table of the sRGB curve; the look-up itself is inline in the header.
#include "server/encode/srgb.h"

#include <cmath>
#include <cstddef>

namespace halflight {

const SrgbCurve& SrgbCurve::Get() {
  static const SrgbCurve curve;
  return curve;
}

SrgbCurve::SrgbCurve() : segments_{} {
  // The power's part alone: the table's first octave reaches below it, but is not looked up there.
  const auto curve_at = [](size_t index) {
    const auto bits = kFirstBits + (static_cast<uint32_t>(index) << kFractionBits);
    return 1.055 * std::pow(static_cast<double>(std::bit_cast<float>(bits)), 1.0 / 2.4) - 0.055;
  };
  for (size_t i = 0; i < segments_.size(); ++i) {
    const double start = curve_at(i);
    segments_[i].start = static_cast<float>(start);
    segments_[i].slope = static_cast<float>((curve_at(i + 1) - start) / (1U << kFractionBits));
  }
}

}  // namespace halflight
