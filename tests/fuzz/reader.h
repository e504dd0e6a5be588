// What every reader of particle files is held to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/readers/columns.h"

namespace halflight::fuzz {

// Reads the bytes as a file. Either they are refused with words, or the particles in them are such
// as the server takes, under the name that the client gives them. Memory stays in proportion to the
// file's size.
void CheckReader(absl::StatusOr<client::Columns> (*read)(std::string_view bytes),
                 const uint8_t* data, size_t size);

}  // namespace halflight::fuzz
