// Reads particles from CSV: a header line with the columns' names, then a particle a line.
// Leaves out quoted fields that go on over several lines, and separators other than the comma.
#pragma once

#include <string_view>

#include "absl/status/statusor.h"
#include "client/readers/columns.h"

namespace halflight::client {

// Names are those of MatchColumns; columns of other names may hold anything. Colours are taken as
// linear. Blank lines are passed over.
absl::StatusOr<Columns> ReadCsv(std::string_view bytes);

}  // namespace halflight::client
