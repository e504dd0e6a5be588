#include "server/access/token_table.h"

#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>
#include <openssl/crypto.h>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_split.h"
#include "halflight/sha256.h"

namespace halflight {

absl::StatusOr<TokenTable> TokenTable::Parse(std::string_view text) {
  const auto wrong = [](size_t line, const char* what) {
    return absl::InvalidArgumentError(fmt::format(
        "line {}: {}; allowed: <SHA-256 of the token, 64 hex digits> <tenant>", line, what));
  };
  TokenTable table;
  std::unordered_set<std::string> seen;
  const std::vector<std::string> lines =
      absl::StrSplit(absl::string_view(text.data(), text.size()), '\n');
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string> words =
        absl::StrSplit(lines[i], absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty() || words[0][0] == '#') {
      continue;
    }
    // Whatever is wrong, the line is not repeated: it may hold a token by mistake.
    const bool is_digest = words[0].size() == 2 * kSha256Bytes &&
                           std::all_of(words[0].begin(), words[0].end(), absl::ascii_isxdigit);
    if (!is_digest) {
      return wrong(i + 1, "the first word is no SHA-256");
    }
    if (words.size() != 2 || !IsTenantName(words[1])) {
      return wrong(i + 1, "what follows is not one name of 1 to 128 printable characters");
    }
    if (i + 1 == lines.size()) {
      return wrong(i + 1, "the file ends within it");
    }
    Entry entry{absl::HexStringToBytes(words[0]), words[1]};
    if (!seen.insert(entry.sha256).second) {
      return wrong(i + 1, "the token stands in an earlier line too");
    }
    table.entries_.push_back(std::move(entry));
  }
  if (table.entries_.empty()) {
    return wrong(1, "no token is listed");
  }
  return table;
}

std::optional<std::string> TokenTable::TenantOf(std::string_view token) const {
  // What differs in time is of the digest, which nobody can choose byte by byte; even so all are
  // looked at whole.
  const std::string sha256 = Sha256Of(token);
  const Entry* found = nullptr;
  for (const Entry& entry : entries_) {
    if (CRYPTO_memcmp(entry.sha256.data(), sha256.data(), kSha256Bytes) == 0) {
      found = &entry;
    }
  }
  return found == nullptr ? std::nullopt : std::optional(found->tenant);
}

bool IsTenantName(std::string_view name) {
  constexpr size_t kLongest = 128;
  return !name.empty() && name.size() <= kLongest &&
         std::all_of(name.begin(), name.end(), absl::ascii_isgraph);
}

}  // namespace halflight
