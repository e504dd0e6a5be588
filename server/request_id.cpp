#include "server/request_id.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <random>

#include <fmt/format.h>

namespace halflight {

bool IsRequestId(std::string_view text) {
  return !text.empty() && text.size() <= kMaxRequestIdBytes &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

std::string MakeRequestId() {
  static const uint64_t process =
      (uint64_t{std::random_device()()} << 32U) | std::random_device()();
  static std::atomic<uint64_t> next = 0;
  return fmt::format("{:016x}-{}", process, next++);
}

}  // namespace halflight
