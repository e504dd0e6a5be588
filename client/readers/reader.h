// Reads a particle file of any known format: the table of formats, and the checks common to all.
// How each format is laid out is in its own pair of files. To add one: a pair, and a row in
// reader.cpp.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/particles.h"

namespace halflight::client {

// Reads and checks a whole file. `format` is a name of FormatNames(), or empty to go by the file's
// extension. Errors name the file and the line, byte offset or particle:
//   NotFound, PermissionDenied  the file cannot be opened
//   InvalidArgument             malformed, or a value that no particle can have
//   DataLoss                    shorter than its header says
//   ResourceExhausted           does not fit into memory
absl::StatusOr<Particles> ReadParticles(const std::string& path, std::string_view format = "");

// "ply, csv, npy, raw".
std::string FormatNames();

}  // namespace halflight::client
