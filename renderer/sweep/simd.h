// Eight floats at a time, by the compiler's vector extension: AVX where the file is compiled for
// it, pairs of SSE or NEON registers elsewhere; sixteen where a file defines HALFLIGHT_LANES so.
// Only what the sweep's kernels need.
#pragma once

#include <cstdint>
#include <cstring>

#ifndef HALFLIGHT_LANES
#define HALFLIGHT_LANES 8
#endif
#if HALFLIGHT_LANES == 16
#define HALFLIGHT_LANES_NAMESPACE lanes_16
#else
#define HALFLIGHT_LANES_NAMESPACE lanes_8
#endif

// A namespace for each width, so that no two files mean different things by one name.
namespace halflight::simd {
inline namespace HALFLIGHT_LANES_NAMESPACE {

inline constexpr int kLanes = HALFLIGHT_LANES;
static_assert(kLanes == 8 || kLanes == 16);

using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));
using Ints = int32_t __attribute__((vector_size(kLanes * sizeof(int32_t))));

#define HALFLIGHT_INLINE [[gnu::always_inline]] static inline

HALFLIGHT_INLINE Floats All(float value) { return value - Floats{}; }

HALFLIGHT_INLINE Floats Load(const float* from) {
  Floats value;
  std::memcpy(&value, from, sizeof(value));
  return value;
}

HALFLIGHT_INLINE void Store(const Floats& value, float* to) {
  std::memcpy(to, &value, sizeof(value));
}

HALFLIGHT_INLINE Floats Max(const Floats& a, const Floats& b) { return a > b ? a : b; }
HALFLIGHT_INLINE Floats Min(const Floats& a, const Floats& b) { return a < b ? a : b; }

HALFLIGHT_INLINE Floats Sqrt(const Floats& x) {
  Floats root{};
  for (int i = 0; i < kLanes; ++i) root[i] = __builtin_sqrtf(x[i]);
  return root;
}

// 0, 1, 2 ...
HALFLIGHT_INLINE Ints LaneNumbers() {
  Ints numbers{};
  for (int i = 0; i < kLanes; ++i) numbers[i] = i;
  return numbers;
}

using Eight = float __attribute__((vector_size(8 * sizeof(float))));

// The first eight lanes plus those after them.
HALFLIGHT_INLINE Eight FoldToEight(const Floats& x) {
#if HALFLIGHT_LANES == 16
  return __builtin_shufflevector(x, x, 0, 1, 2, 3, 4, 5, 6, 7) +
         __builtin_shufflevector(x, x, 8, 9, 10, 11, 12, 13, 14, 15);
#else
  return x;
#endif
}

// The sums of eight vectors' lanes, in their order.
HALFLIGHT_INLINE Eight SumsOf(const Floats* x) {
  Eight pairs[4];
  for (int i = 0; i < 4; ++i) {
    const Eight a = FoldToEight(x[2 * i]);
    const Eight b = FoldToEight(x[2 * i + 1]);
    pairs[i] = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14) +
               __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
  }
  Eight fours[2];
  for (int i = 0; i < 2; ++i) {
    const Eight& a = pairs[2 * i];
    const Eight& b = pairs[2 * i + 1];
    fours[i] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13) +
               __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
  }
  return __builtin_shufflevector(fours[0], fours[1], 0, 1, 2, 3, 8, 9, 10, 11) +
         __builtin_shufflevector(fours[0], fours[1], 4, 5, 6, 7, 12, 13, 14, 15);
}

// 2^n and f q(f), of which exp(-x) = 2^n (1 + f q(f)), for x in [-41, 87] and these bounds
// beyond: so much that nothing overflows where it is multiplied by 0. The polynomial is 2^f - 1
// on
// [-1/2, 1/2], its Taylor series to degree 7, whose rest is below 6e-9.
struct ExpParts {
  Floats power;
  Floats fraction;
};
HALFLIGHT_INLINE ExpParts SplitExpOfMinus(const Floats& x) {
  constexpr float kLog2E = 1.44269504F;
  constexpr float kRound = 12582912.0F;  // 1.5 * 2^23: adding it rounds to whole numbers
  const Floats t = Min(Max(x * -kLog2E, All(-126.0F)), All(60.0F));
  const Floats shifted = t + kRound;
  const Floats whole = shifted - kRound;
  const Floats f = (t - whole) * 0.693147181F;
  Floats q = All(1.0F / 5040.0F);
  q = q * f + 1.0F / 720.0F;
  q = q * f + 1.0F / 120.0F;
  q = q * f + 1.0F / 24.0F;
  q = q * f + 1.0F / 6.0F;
  q = q * f + 0.5F;
  q = q * f + 1.0F;
  const Ints exponent = (__builtin_convertvector(whole, Ints) + 127) << 23;
  Floats power;
  std::memcpy(&power, &exponent, sizeof(power));
  return {power, f * q};
}

// exp(-x) for x in [-41, 86], from 2^-125 to 2^60, and these beyond; exactly 1 at 0. The
// polynomial is e^f on [-ln 2 / 2, ln 2 / 2], through 1 and Chebyshev's nodes; its error is
// below 2.5e-7.
HALFLIGHT_INLINE Floats ExpOfMinus(const Floats& x) {
  constexpr float kLog2E = 1.44269504F;
  constexpr float kRound =
      12582912.0F;  // 1.5 * 2^23: adding it leaves whole numbers in the low bits
  const Floats t = Min(Max(x * -kLog2E, All(-125.0F)), All(60.0F));
  const Floats shifted = t + kRound;
  const Floats f = (t - (shifted - kRound)) * 0.693147181F;
  Floats q = All(0.00836317905F);
  q = q * f + 0.0418756863F;
  q = q * f + 0.16666577F;
  q = q * f + 0.499993719F;
  q = q * f + 1.0F;
  Ints bits;
  Ints exponent;
  const Floats fraction = q * f + 1.0F;
  std::memcpy(&bits, &fraction, sizeof(bits));
  std::memcpy(&exponent, &shifted, sizeof(exponent));
  bits += exponent << 23;
  Floats result;
  std::memcpy(&result, &bits, sizeof(result));
  return result;
}

// 1 - exp(-x), x >= 0, with all its digits where x is small.
HALFLIGHT_INLINE Floats OpacityOf(const Floats& x) {
  const ExpParts parts = SplitExpOfMinus(x);
  return (1.0F - parts.power) - parts.power * parts.fraction;
}

// The same for x up to kThin, by a polynomial of it over x that is 1 at 0 and meets it at
// Chebyshev's nodes: its error is below 1e-7 of it.
constexpr float kThin = 0.5F;
HALFLIGHT_INLINE Floats OpacityOfThin(const Floats& x) {
  Floats q = All(0.00681883097F);
  q = q * x - 0.0410533616F;
  q = q * x + 0.166566794F;
  q = q * x - 0.499994899F;
  q = q * x + 1.0F;
  return x * q;
}

// -log(m), with a = 1 - m where that has the digits that m has not: for |a| < 1/8, of either sign.
// m > 0 and normal. 2 artanh of a / (2 - a), or of the same for what of m is no power of two; of
// its series s^11 / 11 and on is left out, below 3e-9 of it.
HALFLIGHT_INLINE Floats OpticalDepthOf(const Floats& a, const Floats& m) {
  constexpr int32_t kRootHalf = 0x3f3504f3;
  Ints bits;
  std::memcpy(&bits, &m, sizeof(bits));
  const Ints exponent = (bits - kRootHalf) >> 23;
  bits -= exponent << 23;
  Floats fraction;  // in [sqrt(1/2), sqrt(2))
  std::memcpy(&fraction, &bits, sizeof(fraction));
  const Floats magnitude = Max(a, -a);
  const Floats s = magnitude < 0.125F ? a / (2.0F - a) : (1.0F - fraction) / (1.0F + fraction);
  const Floats powers =
      magnitude < 0.125F ? Floats{} : __builtin_convertvector(exponent, Floats) * 0.693147181F;
  const Floats squared = s * s;
  Floats series = All(1.0F / 9.0F);
  series = series * squared + 1.0F / 7.0F;
  series = series * squared + 1.0F / 5.0F;
  series = series * squared + 1.0F / 3.0F;
  return 2.0F * s + (2.0F * s * squared * series - powers);
}

}  // namespace HALFLIGHT_LANES_NAMESPACE
}  // namespace halflight::simd
