// The sRGB transfer function from linear light to code values, fast enough for every pixel.
// Leaves out the way back, and every other colour space.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace halflight {

// The piecewise closed form of IEC 61966-2-1, looked up: the power's part is interpolated linearly
// in a table with 1024 entries an octave. That is within 5e-8 of the closed form, 0.003 of a step
// of 16 bits.
class SrgbCurve {
 public:
  // Built on first use; any thread.
  static const SrgbCurve& Get();

  // For any linear value: [0, 1], clamped; not a number gives 0.
  [[nodiscard]] float operator()(float linear) const {
    if (!(linear > 0.0F)) return 0.0F;
    if (linear >= 1.0F) return 1.0F;
    if (linear <= kLinearPartEnd) return 12.92F * linear;
    const uint32_t position = std::bit_cast<uint32_t>(linear) - kFirstBits;
    const Segment& segment = segments_[position >> kFractionBits];
    return segment.start + segment.slope * static_cast<float>(position & kFractionMask);
  }

 private:
  struct Segment {
    float start;
    float slope;  // a unit in the last place of the linear value
  };

  // Equal steps of a float's bits are equal steps of its value within an octave, so the leading
  // bits serve as the table's index.
  static constexpr float kLinearPartEnd = 0.0031308F;
  static constexpr float kFirst = 0x1p-9F;  // the octave that holds the end of the linear part
  static constexpr uint32_t kOctaves = 9;   // up to 1
  static constexpr uint32_t kFirstBits = std::bit_cast<uint32_t>(kFirst);
  static constexpr uint32_t kFractionBits = 13;
  static constexpr uint32_t kFractionMask = (1U << kFractionBits) - 1U;
  static constexpr uint32_t kSegmentsPerOctave = 1U << (23U - kFractionBits);

  SrgbCurve();

  std::array<Segment, std::size_t{kOctaves} * kSegmentsPerOctave> segments_;
};

}  // namespace halflight
