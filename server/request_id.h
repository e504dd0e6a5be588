// The names by which calls and frames are found in logs: what they may look like, and making one.
#pragma once

#include <string>
#include <string_view>

namespace halflight {

// Call metadata in both directions: the name that a client gives its call, and the one that the
// call has.
inline constexpr char kRequestIdKey[] = "x-request-id";

inline constexpr size_t kMaxRequestIdBytes = 128;

// 1 to kMaxRequestIdBytes bytes of printable ASCII.
bool IsRequestId(std::string_view text);

// One that no other server, and this one after a restart neither, is likely to make.
std::string MakeRequestId();

}  // namespace halflight
