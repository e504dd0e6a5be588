// One particle set as a file: the 40 bytes of particles.proto that go before the payload, then the
// payload, so that the file's SHA-256 is the set's name. Knows nothing of names of files.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/scene.h"
#include "server/limits.h"

namespace halflight {

// Bytes of the file of a set.
uint64_t ParticleFileBytes(const ParticleSet& set);

// Writes the file of a set of one particle or more: of an empty one nobody knows any more which
// arrays it was named with. ResourceExhausted where the disk is full, Unavailable where it cannot
// be written otherwise.
absl::Status WriteParticleFile(const ParticleSet& set, int fd);

// The set of a file that is open at its beginning. DataLoss where the file is not, to the last
// byte, the set of this name, or is one that the limits do not allow; Unavailable where it cannot
// be read.
absl::StatusOr<std::shared_ptr<const ParticleSet>> ReadParticleFile(int fd,
                                                                    const std::string& sha256,
                                                                    const ServerLimits& limits);

// The error of a system call that failed with this errno, as above; `what` it was about to do.
absl::Status SystemError(int error, const std::string& what);

}  // namespace halflight
