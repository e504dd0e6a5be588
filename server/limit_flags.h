// The flags that say what the server accepts at most: what they are called, and what they may be.
#pragma once

#include <CLI/CLI.hpp>

#include "server/convert/field_checks.h"
#include "server/options.h"

namespace halflight {

// For flags of whole numbers: what else there is than digits is refused.
CLI::Validator DecimalNumber();

// Those of ServerLimits, and what else there is a limit on.
void AddLimitFlags(CLI::App& app, Options& options);

// Once the flags are read: of what is shared, one client's part where no flag said it, which is
// three quarters, and enough for one frame or set.
void FillInShares(const CLI::App& app, ServerLimits& limits);

// Rejects those that make no sense, alone or together.
void CheckLimits(const Options& options, FieldChecks& checks);

}  // namespace halflight
