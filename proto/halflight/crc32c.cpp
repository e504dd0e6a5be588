#include "halflight/crc32c.h"

#include <array>
#include <cstddef>
#include <cstring>

#ifdef __x86_64__
#include <nmmintrin.h>
#endif

namespace halflight {
namespace {

using Table = std::array<uint32_t, 256>;

// What each byte does to a remainder, its bits reflected as the polynomial's are.
constexpr Table MakeTable() {
  constexpr uint32_t kReflectedPolynomial = 0x82F63B78;
  Table table{};
  for (uint32_t byte = 0; byte < table.size(); ++byte) {
    uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder >> 1U) ^ ((remainder & 1U) != 0 ? kReflectedPolynomial : 0U);
    }
    table[byte] = remainder;
  }
  return table;
}

#ifdef __x86_64__
// A linear map of remainders: what becomes of each bit.
using BitMap = std::array<uint32_t, 32>;

constexpr uint32_t Apply(const BitMap& map, uint32_t remainder) {
  uint32_t mapped = 0;
  for (uint32_t bit = 0; bit < map.size(); ++bit) {
    mapped ^= map[bit] & (0U - ((remainder >> bit) & 1U));
  }
  return mapped;
}

// What `bytes` zero bytes, a power of two, do to a remainder.
constexpr BitMap MakeZeros(size_t bytes) {
  constexpr Table kTable = MakeTable();
  BitMap map{};
  for (uint32_t bit = 0; bit < map.size(); ++bit) {
    const uint32_t remainder = 1U << bit;
    map[bit] = kTable[remainder & 0xFFU] ^ (remainder >> 8U);
  }
  for (; bytes > 1; bytes /= 2) {
    const BitMap half = map;
    for (uint32_t& mapped : map) mapped = Apply(half, mapped);
  }
  return map;
}

inline uint64_t WordAt(const char* at) {
  uint64_t word = 0;
  std::memcpy(&word, at, sizeof(word));
  return word;
}

// The instruction gives a result each cycle but takes three to it, so three blocks are gone through
// at once and their remainders joined: that of what comes before others is theirs if they were
// zero.
__attribute__((target("sse4.2"))) uint32_t ExtendInHardware(uint32_t crc, std::string_view bytes) {
  constexpr size_t kBlock = 4096;
  static constexpr BitMap kPastBlock = MakeZeros(kBlock);
  uint64_t remainder = ~crc;
  const char* at = bytes.data();
  const char* const end = at + bytes.size();
  for (; end - at >= static_cast<ptrdiff_t>(3 * kBlock); at += 3 * kBlock) {
    uint64_t second = 0;
    uint64_t third = 0;
    for (const char* word = at; word != at + kBlock; word += sizeof(uint64_t)) {
      remainder = _mm_crc32_u64(remainder, WordAt(word));
      second = _mm_crc32_u64(second, WordAt(word + kBlock));
      third = _mm_crc32_u64(third, WordAt(word + 2 * kBlock));
    }
    remainder = Apply(kPastBlock, static_cast<uint32_t>(remainder)) ^ second;
    remainder = Apply(kPastBlock, static_cast<uint32_t>(remainder)) ^ third;
  }
  for (; end - at >= static_cast<ptrdiff_t>(sizeof(uint64_t)); at += sizeof(uint64_t)) {
    remainder = _mm_crc32_u64(remainder, WordAt(at));
  }
  auto last = static_cast<uint32_t>(remainder);
  for (; at != end; ++at) last = _mm_crc32_u8(last, static_cast<unsigned char>(*at));
  return ~last;
}
#endif

}  // namespace

uint32_t ExtendCrc32cPortably(uint32_t crc, std::string_view bytes) {
  static constexpr Table kTable = MakeTable();
  uint32_t remainder = ~crc;
  for (const char c : bytes) {
    remainder = kTable[(remainder ^ static_cast<unsigned char>(c)) & 0xFFU] ^ (remainder >> 8U);
  }
  return ~remainder;
}

uint32_t ExtendCrc32c(uint32_t crc, std::string_view bytes) {
#ifdef __x86_64__
  static const bool has_instruction = __builtin_cpu_supports("sse4.2") != 0;
  if (has_instruction) return ExtendInHardware(crc, bytes);
#endif
  return ExtendCrc32cPortably(crc, bytes);
}

}  // namespace halflight
