// CRC-32C (Castagnoli, as in RFC 3720), which seals outputs: against a byte lost or mixed up on the
// way, not against anybody who means it. Processors have an instruction for it, so that it costs a
// quarter of what SHA-256 does; names that must not collide are made with that (sha256.h).
#pragma once

#include <cstdint>
#include <string_view>

namespace halflight {

// Of the bytes that gave `crc`, followed by these. 0 is that of no bytes.
uint32_t ExtendCrc32c(uint32_t crc, std::string_view bytes);

// The same without the instruction, for machines that lack it.
uint32_t ExtendCrc32cPortably(uint32_t crc, std::string_view bytes);

}  // namespace halflight
