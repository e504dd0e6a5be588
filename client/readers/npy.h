// Reads particles from NumPy's NPY files, versions 1 to 3: an array of shape (N, 3), x y z, or
// (N, 4), x y z radius. Leaves out structured arrays, pickled objects and NPZ archives.
#pragma once

#include <string_view>

#include "absl/status/statusor.h"
#include "client/readers/columns.h"

namespace halflight::client {

// f4 or f8, either byte order, C or Fortran order.
absl::StatusOr<Columns> ReadNpy(std::string_view bytes);

}  // namespace halflight::client
