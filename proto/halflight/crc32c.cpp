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
__attribute__((target("sse4.2"))) uint32_t ExtendInHardware(uint32_t crc, std::string_view bytes) {
  uint64_t remainder = ~crc;
  const char* at = bytes.data();
  const char* const end = at + bytes.size();
  for (; end - at >= static_cast<ptrdiff_t>(sizeof(uint64_t)); at += sizeof(uint64_t)) {
    uint64_t word = 0;
    std::memcpy(&word, at, sizeof(word));
    remainder = _mm_crc32_u64(remainder, word);
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
