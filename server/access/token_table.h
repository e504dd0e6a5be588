// Bearer tokens and whose they are, as a file lists them. The tokens themselves are not in it: who
// reads the file cannot use it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace halflight {

class TokenTable {
 public:
  // Lines "<SHA-256 of the token, 64 hex digits> <tenant>"; empty lines and those that begin with
  // '#' say nothing. InvalidArgument "line N: ..." for anything else, for a file without a token
  // and for one that does not end with its line: it may be half written.
  static absl::StatusOr<TokenTable> Parse(std::string_view text);

  // The tenant of a token; none where nobody has it. Takes as long whichever of them it is.
  [[nodiscard]] std::optional<std::string> TenantOf(std::string_view token) const;

 private:
  struct Entry {
    std::string sha256;
    std::string tenant;
  };
  std::vector<Entry> entries_;
};

// Names of tenants stand in logs and figures: 1 to 128 printable characters of ASCII, no spaces.
bool IsTenantName(std::string_view name);

}  // namespace halflight
